"""One window for a folder: two would write the same session file, and one forget what the other did."""

import hashlib
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from filelock import FileLock, Timeout

from opencsp_calib.errors import InputError

__all__ = ["only_window"]


@contextmanager
def only_window(folder: Path) -> Iterator[None]:
    """Refuse a second window of this machine for a folder while the block runs; a crash leaves nothing locked.

    Raises
    ------
    InputError
        If there is one.
    """
    key = hashlib.sha256(str(folder.resolve()).encode(errors="surrogateescape")).hexdigest()[:16]
    lock = FileLock(Path(tempfile.gettempdir()) / f"opencsp-calib-window-{key}.lock", mode=0o666)
    try:
        lock.acquire(timeout=0)
    except Timeout:
        raise InputError(
            f"{folder.resolve()} is open in another window already: go on in its page, or stop its opencsp-calib gui"
        ) from None
    except OSError:  # another user's lock of an earlier day, or nowhere to put one: better no lock than no window
        pass
    try:
        yield
    finally:
        lock.release()
