"""Processes of our own, each running one module: asked on its standard input, answering on its standard output."""

import os
import subprocess
import sys
from typing import IO, Any

__all__ = ["BACKGROUND", "answers", "own_process"]

BACKGROUND: dict[str, Any] = {"creationflags": getattr(subprocess, "BELOW_NORMAL_PRIORITY_CLASS", 0)}
"""What Windows wants to be told, beside the command, where a process is started that runs in the background."""


def own_process(module: str, *, background: bool = False) -> list[str]:
    """The command that runs the ``main`` of a module.

    Without the current folder in its path: people start us in their folders of photographs, and a file named
    ``random.py`` there must not take the place of Python's own. Ctrl-C is for the process that started it.

    Parameters
    ----------
    module : str
    background : bool
        Whether it leaves the processor to what people look at; on Windows `BACKGROUND` does that. Here before anything
        is imported, because on Linux a library's threads keep the priority that they were started with.
    """
    steps = [
        "import _signal, os, sys",  # what signal itself is made of: loading that takes as long as all of Python's start
        "_signal.signal(_signal.SIGINT, _signal.SIG_IGN)",
        "hasattr(os, 'nice') and os.nice(10)" if background else "",
        "sys.path[:] = filter(None, sys.path)",
        f"from {module} import main",
        "main()",
    ]
    return [sys.executable, "-c", "; ".join(filter(None, steps))]


def answers(mode: str) -> IO[Any]:
    """The standard output for answers alone: what a library prints goes to the standard error, and garbles none.

    Parameters
    ----------
    mode : 'w' or 'wb'
    """
    kept = os.fdopen(os.dup(sys.stdout.fileno()), mode, encoding=None if "b" in mode else "utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    return kept
