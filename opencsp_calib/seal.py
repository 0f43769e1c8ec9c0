"""A seal at the end of a file: a line with the checksum of all that stands before it.

HDF5 passes over what follows its own end, so that any program reads a sealed file; one that changes the file cuts the
seal off. A file that still has a seal must fit it, before a parser sees a single byte: the HDF5 library takes damaged
bytes for others without a word, and over some of them it hangs or crashes.
"""

import hashlib
import os
from pathlib import Path
from typing import BinaryIO

from opencsp_calib.errors import FileFormatError

__all__ = ["check_seal", "seal"]

MARK = b"\nopencsp-calib sealed this file; SHA-256 of what is before: "
START = MARK[:20]
LENGTH = len(MARK) + 64 + 1
CHUNK = 2**20


def seal(file: BinaryIO) -> None:
    """Put a seal behind the content of a file that is open for reading and writing."""
    file.write(_seal_of(file, file.seek(0, os.SEEK_END)))


def check_seal(path: str | os.PathLike[str]) -> None:
    """Nothing, if a file fits its seal or has none.

    Raises
    ------
    FileFormatError
        If it does not fit, or the seal itself is damaged.
    OSError
        If the file cannot be read.
    """
    with Path(path).open("rb") as file:
        left = file.seek(0, os.SEEK_END) - LENGTH
        if left < 0:
            return
        file.seek(left)
        found = file.read()
        if not _like_a_seal(found):
            return
        expected = _seal_of(file, left)
    if found != expected:
        raise FileFormatError(f"{path} is damaged: its checksum does not fit its contents; use another copy of it")


def _seal_of(file: BinaryIO, length: int) -> bytes:
    """Of so many bytes from the beginning of a file, after which its position is then."""
    file.seek(0)
    digest = hashlib.sha256()
    while length > 0 and (chunk := file.read(min(CHUNK, length))):
        digest.update(chunk)
        length -= len(chunk)
    return MARK + digest.hexdigest().encode() + b"\n"


def _like_a_seal(end: bytes) -> bool:
    """Whether the end of a file is a seal, or what damage has left of one."""
    return START in end or sum(a == b for a, b in zip(end, MARK, strict=False)) > len(MARK) // 2
