"""Writing an HDF5 file aside and then in place, without ever telling the HDF5 library that something went wrong.

A file that it could not write, it never closes: it tries again when the process ends, and may bring it down. So it
writes through Python into a file that takes everything; what the disk had to say is raised when HDF5 is done.
"""

import contextlib
import io
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from opencsp_calib.atomic import replacing
from opencsp_calib.errors import InputError
from opencsp_calib.hdf5_reading import EXTENSIONS
from opencsp_calib.seal import seal

if TYPE_CHECKING:
    import h5py

__all__ = ["write_hdf5"]


def write_hdf5(path: str | os.PathLike[str], fill: "Callable[[h5py.File], None]") -> None:
    """Have an HDF5 file filled, seal it, and put it in place when all of that ended well.

    A thread of its own fills it: in the main one, Ctrl-C strikes wherever Python runs, also within HDF5's writing.

    Parameters
    ----------
    path : path-like
    fill : callable
        Writes into the empty file that it is given; what it raises comes through, and no file is left.

    Raises
    ------
    InputError
        If it has the extension of something else, or cannot be written; what was there before stays.
    """
    if Path(path).suffix.lower() not in ("", *EXTENSIONS):
        raise InputError(
            f"{path} would be HDF5 under another name: let its name end in .h5; other formats are written by "
            "`opencsp-calib convert`, and in Python by opencsp_calib.camera_files.write_camera_file"
        )
    with replacing(path) as temporary:
        with ThreadPoolExecutor(1) as thread:
            thread.submit(_fill, temporary, fill).result()
        with temporary.open("rb+") as file:
            seal(file)


def _fill(path: Path, fill: "Callable[[h5py.File], None]") -> None:
    import h5py

    with path.open("rb+", buffering=0) as disk:
        content = _TakesEverything(disk)
        with h5py.File(content, "w") as file:
            fill(file)
    if content.error:
        raise content.error


class _TakesEverything(io.RawIOBase):
    """A file on a disk, which goes on in memory when the disk takes no more, and keeps the error."""

    def __init__(self, disk: io.FileIO) -> None:
        self._file: io.FileIO | io.BytesIO = disk
        self.error: OSError | None = None

    def seek(self, place: int, whence: int = os.SEEK_SET) -> int:
        return self._file.seek(place, whence)

    def tell(self) -> int:
        return self._file.tell()

    def readinto(self, buffer: Any) -> int | None:
        return self._file.readinto(buffer)

    def write(self, data: Any) -> int:
        rest = memoryview(data)
        while rest:
            try:
                rest = rest[self._file.write(rest) :]
            except OSError as error:
                self._leave_disk(error)
        return len(data)

    def truncate(self, size: int | None = None) -> int:
        try:
            return self._file.truncate(size)
        except OSError as error:
            self._leave_disk(error)
            return self._file.truncate(size)

    def _leave_disk(self, error: OSError) -> None:
        self.error, disk, place = error, self._file, self._file.tell()
        self._file = io.BytesIO()
        with contextlib.suppress(OSError):
            disk.seek(0)
            self._file.write(disk.read())
        self._file.seek(place)
