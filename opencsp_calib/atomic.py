"""Writing files so that nobody ever finds half of one."""

import contextlib
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from opencsp_calib.errors import InputError

__all__ = ["check_writable", "replacing"]


def check_writable(path: str | os.PathLike[str]) -> Path:
    """The path, if a file can be written there; to be asked before long work.

    Raises
    ------
    InputError
        If its folder does not exist or cannot be written to, or it is a folder.
    """
    path = Path(path)
    folder = path.parent
    if not folder.is_dir():
        raise InputError(f"cannot write {path}: the folder {folder} does not exist; create it first")
    if path.is_dir():
        raise InputError(f"cannot write {path}: it is a folder; add a file name")
    if not os.access(folder, os.W_OK) or (path.exists() and not os.access(path, os.W_OK)):
        raise InputError(f"cannot write {path}: no permission")
    return path


@contextmanager
def replacing(path: str | os.PathLike[str]) -> Iterator[Path]:
    """A temporary file in the same folder, which takes the place of `path` when the block ends well.

    When the block raises, whatever stood at `path` before is still there, and the temporary file is gone.

    Parameters
    ----------
    path : path-like

    Yields
    ------
    Path
        An empty file to write to, with the extension of `path`.

    Raises
    ------
    InputError
        If the folder does not exist, is not writable, or the disk is full.
    """
    path = check_writable(path)
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=".writing-", suffix=path.suffix)
        os.close(handle)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    temporary = Path(name)
    try:
        yield temporary
        _flush(temporary)
        _take_permissions(temporary, path)
        os.replace(temporary, path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(FileNotFoundError):
            temporary.unlink()


def _flush(path: Path) -> None:
    """Have the operating system put the file's contents on the disk."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _take_permissions(temporary: Path, path: Path) -> None:
    """Those of the file to be replaced, else those any new file gets: mkstemp's are for the owner only."""
    if path.exists():
        mode = path.stat().st_mode & 0o777
    else:
        mask = os.umask(0)
        os.umask(mask)
        mode = 0o666 & ~mask
    temporary.chmod(mode)
