"""Running a module of ours in a process of its own."""

import sys

__all__ = ["own_process"]


def own_process(module: str) -> list[str]:
    """The command that runs the ``main`` of a module, without the current folder in its path.

    People start us in their folders of photographs, and a file named ``random.py`` there must not take the place of
    Python's own.
    """
    code = f"import sys; sys.path[:] = filter(None, sys.path); from {module} import main; main()"
    return [sys.executable, "-c", code]
