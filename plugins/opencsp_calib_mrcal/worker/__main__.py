"""Runs mrcal in a Python that has it: ``worker PROBLEM SOLUTION``, two ``.npz`` files, or ``worker --version``.

A folder that is run as it is and imports nothing of opencsp-calib: Debian's mrcal is built for another NumPy than ours
and lives in Debian's Python.
"""

import sys

NO_MRCAL = 3  # exit status


def main(arguments):
    """See the module; the exit status."""
    if arguments == ["--version"]:
        found = version()
        sys.stdout.write(found or "")
        return 0 if found else NO_MRCAL
    import numpy as np
    from problem import solve

    given, solved = arguments
    with np.load(given, allow_pickle=False) as file:
        solution = solve(dict(file))
    np.savez(solved, **solution)
    return 0


def version():
    """The version of mrcal as whoever installed it has it, for mrcal 2.2 does not know its own; None without mrcal."""
    import importlib.metadata
    import importlib.util
    import shutil
    import subprocess

    if importlib.util.find_spec("mrcal") is None:
        return None
    try:
        return importlib.metadata.version("mrcal")
    except importlib.metadata.PackageNotFoundError:
        dpkg = shutil.which("dpkg-query")
    if dpkg is None:
        return "unknown"
    command = [dpkg, "--show", "--showformat=${Version}", "python3-mrcal"]
    return subprocess.run(command, capture_output=True, text=True).stdout.strip() or "unknown"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
