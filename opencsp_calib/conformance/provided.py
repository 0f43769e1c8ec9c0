"""Promises of everything that a plugin provides."""

import re
import subprocess
import sys
from functools import cache
from importlib.util import find_spec

from opencsp_calib.conformance.kit import Setup, promise
from opencsp_calib.interfaces import Provided

__all__ = ["CHECKS"]

PROBE = "import sys, {module}; print(*sorted({{name.split('.')[0] for name in sys.modules}}))"
CORE = "opencsp_calib.registry, opencsp_calib.solving, opencsp_calib.importing, yaml, defusedxml.ElementTree"
"""What the core itself loads when plugins are listed, and parsers of text that plugins may load too."""


def has_a_name_that_can_be_typed(provided: Provided, setup: Setup) -> None:
    """Lower-case letters, digits, hyphens and underscores, beginning with a letter."""
    promise(re.fullmatch(r"[a-z][a-z0-9_-]*", provided.name), f"{provided.name!r} cannot be typed as a name")


def says_what_is_missing(provided: Provided, setup: Setup) -> None:
    """None, or one line; the same when asked again."""
    missing = provided.missing()
    said = missing is None or (isinstance(missing, str) and missing.strip() and "\n" not in missing)
    promise(said, f"missing() must be None or one line that says what to install, not {missing!r}")
    promise(provided.missing() == missing, "missing() changes its mind when asked again")


def loads_no_vendor_when_listed(provided: Provided, setup: Setup) -> None:
    """Importing its module loads the standard library, opencsp_calib and its own package, and nothing else."""
    module = type(provided).__module__
    if module == "__main__" or not _importable(module):
        return  # written on the spot: there is nothing to import
    asked = _run(PROBE.format(module=module))
    promise(asked.returncode == 0, f"{module} cannot be imported by itself: {asked.stderr.strip()[-300:]}")
    own = {module.split(".")[0], "opencsp_calib", "__main__"}
    loaded = {name for name in asked.stdout.split() if not name.startswith("_")}
    vendors = sorted(loaded - own - _loaded_by_core() - set(sys.stdlib_module_names))
    promise(not vendors, f"importing {module} loads {', '.join(vendors)}: import vendors inside functions")


@cache
def _loaded_by_core() -> frozenset[str]:
    return frozenset(_run(PROBE.format(module=CORE)).stdout.split())


def _run(code: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)


def _importable(module: str) -> bool:
    try:
        return find_spec(module) is not None
    except (ImportError, ValueError):
        return False


CHECKS = (has_a_name_that_can_be_typed, says_what_is_missing, loads_no_vendor_when_listed)
