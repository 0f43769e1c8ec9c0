"""Processes of our own, each running one module: asked on its standard input, answering on its standard output."""

import os
import subprocess
import sys
from contextlib import suppress
from pathlib import Path
from typing import IO, Any

__all__ = ["BACKGROUND", "answers", "own_process", "step_back"]

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
        Whether it leaves the processor to what people look at; on Windows `BACKGROUND` does that.
    """
    steps = [
        "import os, signal, sys",
        "signal.signal(signal.SIGINT, signal.SIG_IGN)",
        "sys.path[:] = filter(None, sys.path)",
        "from opencsp_calib.processes import step_back; step_back()" if background else "",
        f"from {module} import main",
        "main()",
    ]
    return [sys.executable, "-c", "; ".join(filter(None, steps))]


def step_back() -> None:
    """Leave the processor to others that want it; to be called before threads are started, which keep what they have.

    Linux shares the processor between sessions first, and weighs the processes of each among themselves only: to step
    back behind a browser, which is another session, a process needs one of its own, with that session's weight.
    """
    if sys.platform != "win32":
        os.nice(10)
        with suppress(OSError):
            os.setsid()
            Path("/proc/self/autogroup").write_text("10", encoding="ascii")


def answers(mode: str) -> IO[Any]:
    """The standard output for answers alone: what a library prints goes to the standard error, and garbles none.

    Parameters
    ----------
    mode : 'w' or 'wb'
    """
    kept = os.fdopen(os.dup(sys.stdout.fileno()), mode, encoding=None if "b" in mode else "utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    return kept
