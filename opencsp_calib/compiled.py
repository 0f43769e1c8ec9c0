"""The compiled fit of corners: compiled once on a machine, kept in a file, loaded when it is first needed.

Importing Numba takes half a second and compiling some seconds; neither happens at import.
"""

import logging
import os
import stat
import tempfile
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from hashlib import sha256
from pathlib import Path
from typing import TypeAlias

from platformdirs import user_cache_path

__all__ = ["FitCorners", "corner_fit", "prepare"]

FitCorners: TypeAlias = Callable[..., None]

SIGNATURE = "void(u2[:, ::1], f8, f8[:, ::1], f8[:, ::1], f8[:, ::1], f8, i8, b1, f8[:, ::1], f8[:, ::1], f8[:, ::1])"
KERNEL = Path(__file__).with_name("corner_kernel")

_log = logging.getLogger(__name__)
_lock = threading.Lock()
_compiled: list[FitCorners] = []


def prepare() -> None:
    """Begin to load the compiled fit in the background, or to compile it; call it when corners will soon be refined."""
    if not _compiled:
        # not a daemon: when the program ends meanwhile, LLVM must not be cut off in mid-work
        threading.Thread(target=corner_fit, name="compile").start()


def corner_fit() -> FitCorners:
    """`opencsp_calib.corner_kernel.fitting.fit_corners`, compiled; waits where another thread is already at it."""
    with _lock:
        if not _compiled:
            _compiled.append(_compile())
        return _compiled[0]


def _compile() -> FitCorners:
    """Kept in the first place that can be written to; without one, for this process only."""
    from numba import njit

    from opencsp_calib.corner_kernel.fitting import fit_corners

    def compiled(cache: bool) -> FitCorners:
        fit: FitCorners = njit(SIGNATURE, cache=cache, nogil=True, error_model="numpy")(fit_corners)
        return fit

    for place in (_beside_the_code, _of_the_user, _private):
        try:
            with _kept_in(place() / _version()):
                return compiled(cache=True)
        except Exception as error:  # read-only, full, damaged: no state of the cache may stop the work
            _log.debug("no cache for the compiled fit: %r", error)
    return compiled(cache=False)


def _version() -> str:
    """A name for what the kernel's files say: Numba looks for changes in the file of the outermost function only."""
    return sha256(b"".join(file.read_bytes() for file in sorted(KERNEL.glob("*.py")))).hexdigest()[:16]


@contextmanager
def _kept_in(folder: Path) -> Iterator[None]:
    """Have Numba keep its cache there; where it cannot write, Numba would silently go elsewhere."""
    from numba import config

    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryFile(dir=folder):
        pass
    usual = config.CACHE_DIR
    config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        config.CACHE_DIR = usual


def _beside_the_code() -> Path:
    """Where Python keeps what it has compiled; or where Numba is told to."""
    from numba import config

    return Path(config.CACHE_DIR or KERNEL / "__pycache__")


def _of_the_user() -> Path:
    return user_cache_path("opencsp-calib", appauthor=False)


def _private() -> Path:
    """A temporary folder that nobody else can write to: it holds code that will be run."""
    user = os.geteuid() if hasattr(os, "geteuid") else ""
    folder = Path(tempfile.gettempdir()) / f"opencsp-calib-compiled-{user}"
    folder.mkdir(mode=0o700, exist_ok=True)
    found = folder.lstat()
    if user != "" and (not stat.S_ISDIR(found.st_mode) or found.st_uid != user or found.st_mode & 0o077):
        raise PermissionError(f"{folder} belongs to somebody else")
    return folder
