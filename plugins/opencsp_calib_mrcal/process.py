"""The Python that has mrcal, and running the worker in it: whatever happens there ends in one line here."""

import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from opencsp_calib import CalibrationFailedError

__all__ = ["VARIABLE", "missing_mrcal", "mrcal_version", "run_mrcal"]

VARIABLE = "OPENCSP_CALIB_MRCAL_PYTHON"
DEBIAN = "/usr/bin/python3"
WORKER = Path(__file__).with_name("worker")  # a folder that is run as it is
PROBE_S = 20.0


def missing_mrcal() -> str | None:
    """One sentence naming what to install when no Python here has mrcal; None when one has."""
    if _found() is not None:
        return None
    chosen = os.environ.get(VARIABLE)
    if chosen:
        return f"{chosen}, which {VARIABLE} names, is not a Python that has mrcal"
    return f"it needs mrcal: apt install python3-mrcal (Debian, Ubuntu), or set {VARIABLE} to a Python that has it"


def mrcal_version() -> str:
    """Such as ``2.2-4+b1``."""
    found = _found()
    return found[1] if found else "unknown"


def run_mrcal(problem: Mapping[str, NDArray[Any]], timeout_s: float) -> dict[str, NDArray[Any]]:
    """What mrcal makes of a problem; see `opencsp_calib_mrcal.worker.problem.solve`.

    Raises
    ------
    CalibrationFailedError
        If mrcal is not there, fails, crashes, is killed, hangs, or answers nonsense.
    """
    found = _found()
    if found is None:
        raise CalibrationFailedError(f"mrcal cannot run: {missing_mrcal()}")
    with tempfile.TemporaryDirectory(prefix="opencsp-calib-mrcal-") as folder:
        given, solved, errors = (Path(folder) / name for name in ("problem.npz", "solution.npz", "errors.txt"))
        np.savez(given, **problem)  # type: ignore[arg-type]  # its third parameter is not one of ours
        # errors go to a file: a pipe that a crashed child's children hold open would be waited for
        with errors.open("wb") as stream:
            status = _run([found[0], str(WORKER), str(given), str(solved)], stream.fileno(), folder, timeout_s)
        if status != 0:
            raise CalibrationFailedError(f"mrcal failed{_why(status, errors)}")
        try:
            with solved.open("rb") as stream:  # opened here, for NumPy would not close what it cannot read
                return dict(np.load(stream, allow_pickle=False))
        except Exception as error:  # a broken zip file makes NumPy raise anything
            raise CalibrationFailedError(f"mrcal's answer cannot be read: {error!r}") from None


def _run(command: list[str], errors: int, folder: str, timeout_s: float) -> int:
    try:
        return subprocess.run(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=errors,
            cwd=folder,
            env=_environment(command[0]),
            timeout=timeout_s,
            check=False,
        ).returncode
    except subprocess.TimeoutExpired:
        message = f"mrcal did not end within {timeout_s:.0f} s and was stopped; take fewer views or another solver"
        raise CalibrationFailedError(message) from None
    except OSError as error:
        raise CalibrationFailedError(f"mrcal's Python {command[0]} cannot be run: {error}") from None


def _why(status: int, errors: Path) -> str:
    """What there is to say about a failed run: the signal that ended it, or the last line it wrote."""
    if status < 0:
        return f": it was ended by signal {-status}"
    lines = errors.read_bytes()[-2000:].decode(errors="replace").strip().splitlines()
    return f": {lines[-1].strip()}" if lines else f" with exit status {status}"


def _found() -> tuple[str, str] | None:
    """The Python that has mrcal, and mrcal's version."""
    chosen = os.environ.get(VARIABLE)
    if chosen:
        candidates = [chosen]
    else:
        own = [sys.executable] if find_spec("mrcal") else []
        candidates = [*own, DEBIAN]
    for python in candidates:
        version = _probed(python)
        if version:
            return python, version
    return None


@cache
def _probed(python: str) -> str:
    """The version of mrcal in that Python; empty if it has none. Does not import mrcal."""
    try:
        asked = subprocess.run(
            [python, str(WORKER), "--version"],
            stdin=subprocess.DEVNULL,
            capture_output=True,
            env=_environment(python),
            timeout=PROBE_S,
            check=False,
        )
    except (OSError, subprocess.TimeoutExpired):
        return ""
    return asked.stdout.decode(errors="replace").strip() if asked.returncode == 0 else ""


def _environment(python: str) -> dict[str, str]:
    """Ours; but Debian's Python must not see packages that were installed for another one.

    None leaves compiled files beside the worker, which nobody would ever remove.
    """
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    if python == DEBIAN:
        environment["PYTHONNOUSERSITE"] = "1"
        for name in ("PYTHONPATH", "PYTHONHOME"):
            environment.pop(name, None)
    return environment
