"""Writing files so that nobody ever finds half of one."""

import contextlib
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from opencsp_calib.errors import InputError

__all__ = ["check_writable", "replacing"]

MAX_NAME = 255  # bytes of a file's name, on nearly every file system
MAX_SUFFIX = 32
NEW, PRIVATE = 0o666, 0o600  # permissions, of which the umask takes some away


def check_writable(path: str | os.PathLike[str]) -> Path:
    """The path, if a file can be written there; to be asked before long work.

    A symbolic link is followed: what it points to is written, and the link stays.

    Raises
    ------
    InputError
        If its folder does not exist or cannot be written to; or it is a folder, a device, a pipe, a link in a circle,
        or has a name that no file can have.
    """
    try:
        return _writable(Path(path))
    except (OSError, RuntimeError, ValueError) as error:  # names too long, or with a null; circles of links
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"cannot write {_short(path)}: {reason}") from None


def _writable(path: Path) -> Path:
    mode = path.stat().st_mode if path.exists() else None  # of what a link leads to
    if mode is not None and stat.S_ISDIR(mode):
        raise InputError(f"cannot write {path}: it is a folder; add a file name")
    if mode is not None and not stat.S_ISREG(mode):
        raise InputError(f"cannot write {path}: it is no regular file, but a device or a pipe")
    target = path.resolve() if path.is_symlink() else path
    if target.is_symlink():
        raise InputError(f"cannot write {path}: it is a link that leads back to itself")
    folder = target.parent
    if not folder.is_dir():
        raise InputError(f"cannot write {path}: the folder {folder} does not exist; create it first")
    if not os.access(folder, os.W_OK) or (mode is not None and not os.access(target, os.W_OK)):
        raise InputError(f"cannot write {path}: no permission")
    if mode is None and len(os.fsencode(target.name)) > MAX_NAME:
        raise InputError(f"cannot write {_short(path)}: the name is longer than {MAX_NAME} bytes")
    return target


def _short(path: str | os.PathLike[str]) -> str:
    text = os.fspath(path)
    return text if len(text) <= MAX_NAME else f"{text[:60]}..."


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
    mode = _permissions(path)
    suffix = path.suffix if len(path.suffix) < MAX_SUFFIX else ""
    temporary = path.with_name(f".writing-{os.urandom(8).hex()}{suffix}")
    try:
        # a new one as any new file, which the system sees to: asking for the process's umask means to change it for a
        # moment, in which other threads make files that are open to everybody
        temporary.touch(NEW if mode is None else PRIVATE, exist_ok=False)
        yield temporary
        _flush(temporary)
        if mode is not None:
            os.chmod(temporary, mode)
        os.replace(temporary, path)
        _flush_folder(path.parent)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror or error}") from error
    finally:
        with contextlib.suppress(FileNotFoundError):
            temporary.unlink()


def _permissions(path: Path) -> int | None:
    with contextlib.suppress(FileNotFoundError):
        return path.stat().st_mode & 0o777
    return None


def _flush(path: Path) -> None:
    """Have the operating system put the file's contents on the disk."""
    with path.open("rb+") as file:
        os.fsync(file.fileno())


def _flush_folder(folder: Path) -> None:
    """Have the new name put on the disk too, where the system can: not Windows, nor every network."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    with contextlib.suppress(OSError):
        handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
