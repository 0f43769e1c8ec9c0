"""A journal: what was found in each image, kept as it comes, so that an interrupted run can go on from there.

A text file of lines, one a result after the first, that is only ever appended to::

    opencsp-calib journal 1
    CHECKSUM LENGTH SEARCH IMAGE {"size": ..., "view": ..., "arrays": ...}

CHECKSUM is the SHA-256 of the rest of the line, LENGTH the bytes of its JSON, SEARCH the key of the search
(`opencsp_calib.looking.Search.key`: board, detector, refinement, versions), IMAGE the SHA-256 of the image file.
Arrays are in base64, to the last bit. A line that is torn, damaged or of another search is passed over; since each
begins on a line of its own, whatever was torn before it does no harm, and neither does a second run that appends to
the same file.
"""

import base64
import binascii
import contextlib
import hashlib
import json
import os
import threading
import time
import warnings
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.errors import CalibError, InputError
from opencsp_calib.looking import Look
from opencsp_calib.view_json import OPTIONAL, restored_view, stored_view

__all__ = ["Journal", "journal_beside"]

HEADER = b"opencsp-calib journal 1\n"
MAX_LINE = 2**26  # bytes; the largest board takes less
SYNC_S = 1.0  # so much work a power cut may cost: a disk takes up to 20 ms to be sure of a line


class Journal:
    """What was found in each image of a run, in a file.

    Parameters
    ----------
    path : path-like
        Made where there is none; otherwise appended to.
    resume : bool
        Whether what the file already holds is taken as found.

    Attributes
    ----------
    taken : int
        Results that were taken from the file.
    foreign : int
        Lines of other searches, which were passed over.
    """

    def __init__(self, path: str | os.PathLike[str], *, resume: bool = True) -> None:
        self.path = Path(path)
        self.taken = self.foreign = 0
        self._resume = resume
        self._lock = threading.Lock()
        self._places: dict[str, tuple[int, int]] = {}
        self._search = ""
        self._file: BinaryIO | None = None
        self._ours = False
        self._synced_s = 0.0

    @contextmanager
    def open(self, search: str) -> "Iterator[Journal]":
        """The journal, open for the search of that key.

        Raises
        ------
        InputError
            If the file cannot be made or read, or is something else; where nothing is to be taken from it, that is
            only a warning, and nothing is kept.
        """
        self._search = search
        try:
            self._open()
        except InputError as error:
            if self._resume:
                raise
            warnings.warn(str(error), RuntimeWarning, stacklevel=4)
        try:
            yield self
            if self._file:
                os.fsync(self._file.fileno())
        finally:
            if self._file:
                self._file.close()
            self._file = None

    def find(self, sha256: str, name: str) -> Look | None:
        """What was found in the image of that content, under the name it has now; None if it is not known."""
        with self._lock:
            if sha256 not in self._places or self._file is None:
                return None
            place, length = self._places[sha256]
            self._file.seek(place)
            line = self._file.read(length)
        look = _look(line)
        if look is None:
            return None
        with self._lock:
            self.taken += 1
        return replace(look, view=replace(look.view, image=name))

    def add(self, look: Look) -> None:
        """Keep a result; one without the content's hash (a file that cannot be read) is not kept.

        Where the disk is full or gone, the run goes on without a journal, with a warning.
        """
        if not look.view.sha256:
            return
        line = _line(look, self._search)
        with self._lock:
            if self._file is None:
                return
            try:
                if self._file.write(line) != len(line):
                    raise OSError(0, "the disk is full")
                if time.monotonic() - self._synced_s > SYNC_S:
                    os.fsync(self._file.fileno())
                    self._synced_s = time.monotonic()
            except OSError as error:
                self._file.close()
                self._file = None
                message = f"results can no longer be kept in {self.path} ({error.strerror}); the run goes on"
                warnings.warn(message, RuntimeWarning, stacklevel=2)

    def remove(self) -> None:
        """Delete the file: its results are safe elsewhere, or nobody wants them."""
        if self._ours:
            with contextlib.suppress(OSError):  # on Windows, while another run has it open: that run will
                self.path.unlink(missing_ok=True)

    def _open(self) -> None:
        try:
            # unbuffered, so that each line is one call, and lines of two runs do not mix
            file = self.path.open("ab+", buffering=0)
            try:
                file.seek(0)
                start = file.read(len(HEADER))
                if start != HEADER:
                    if start.strip(b"\0") and not HEADER.startswith(start):  # not torn at its birth either
                        raise InputError(f"{self.path} is not a journal of opencsp-calib; move it away")
                    file.truncate(0)
                    file.write(HEADER)
                self._ours = True
                if self._resume:
                    self._places = dict(self._lines())
            except BaseException:
                file.close()
                raise
        except OSError as error:
            raise InputError(f"what is done cannot be kept in {self.path}: {error.strerror}") from None
        self._file = file

    def _lines(self) -> Iterator[tuple[str, tuple[int, int]]]:
        """Image, place and length of every whole line of this search; those of others are counted."""
        with self.path.open("rb") as file:
            place = 0
            while line := file.readline(MAX_LINE):
                search, image = _heading(line)
                if search == self._search:
                    yield image, (place, len(line))
                elif search:
                    self.foreign += 1
                place += len(line)


def journal_beside(output: str | os.PathLike[str]) -> Path:
    """Where the journal of a run is whose result goes to `output`."""
    return Path(f"{os.fspath(output)}.journal")


def _line(look: Look, search: str) -> bytes:
    detection = look.view.detection
    arrays = {name: _packed(getattr(detection, name)) for name in ("ids", "pixels", *OPTIONAL)}
    content = json.dumps({"size": look.size, "view": stored_view(look.view), "arrays": arrays})
    rest = f"{len(content)} {search} {look.view.sha256} {content}".encode()
    return b"\n" + hashlib.sha256(rest).hexdigest().encode() + b" " + rest + b"\n"


def _heading(line: bytes) -> tuple[str, str]:
    """The search and the image of a line; empty where it is not whole."""
    checksum, _, rest = line.rstrip(b"\n").partition(b" ")
    if not line.endswith(b"\n") or hashlib.sha256(rest).hexdigest().encode() != checksum:
        return "", ""
    try:
        length, search, image, content = rest.decode().split(" ", 3)
        return (search, image) if int(length) == len(content) else ("", "")
    except ValueError:
        return "", ""


def _look(line: bytes) -> Look | None:
    """What a line says; None where it is no longer whole, or says nothing that can be."""
    try:
        _, image = _heading(line)
        entry = json.loads(line.split(b" ", 4)[4])
        view = restored_view(entry["view"], _arrays(entry["arrays"]))
        width, height = entry["size"]
        return Look(view, (int(width), int(height))) if image == view.sha256 else None
    except (CalibError, ValueError, TypeError, KeyError, IndexError, RecursionError):
        return None


def _packed(array: Any) -> str | None:
    if array is None:
        return None
    return base64.b64encode(np.ascontiguousarray(array, dtype=array.dtype.newbyteorder("<")).tobytes()).decode()


def _arrays(entry: Mapping[str, str | None]) -> dict[str, Floats | None]:
    ids = _unpacked(entry["ids"], "<i8", (-1,))
    if ids is None:
        raise ValueError("a detection without ids")
    shapes = {"pixels": (2,), **OPTIONAL}
    arrays = {name: _unpacked(entry[name], "<f8", (len(ids), *shape)) for name, shape in shapes.items()}
    return {"ids": ids, **arrays}


def _unpacked(text: str | None, kind: str, shape: tuple[int, ...]) -> Any:
    if text is None:
        return None
    try:
        return np.frombuffer(base64.b64decode(text, validate=True), dtype=kind).reshape(shape)
    except binascii.Error as error:
        raise ValueError(str(error)) from None
