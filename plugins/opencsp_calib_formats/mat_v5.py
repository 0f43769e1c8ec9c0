"""Version 5 .mat files, read without trust: nothing is allocated before the bytes for it are there.

A file is 128 bytes of header, then elements: a tag (type, bytes) and data, padded to 8 bytes; short ones have type and
size in one word. A miMATRIX holds flags, dimensions, name, and its content, which for cells and structures is miMATRIX
again; miCOMPRESSED is an element packed by zlib.

Why not scipy, which reads these files too: its compiled reader believes the types in a file, and one in fifty damaged
files ends the process with a segmentation fault. The tests hold this reader against it.

Source: MathWorks, "MAT-File Format".
"""

import math
import struct
import zlib
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from opencsp_calib.errors import FileFormatError

__all__ = ["Opaque", "elements"]

INT8, INT32, MATRIX, COMPRESSED = 1, 5, 14, 15
CELL, STRUCT, OBJECT, CHAR, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
NUMBERS = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 9: "f8", 12: "i8", 13: "u8"}
TEXTS = {1: "latin-1", 2: "latin-1", 16: "utf-8", 4: "utf-16", 17: "utf-16", 18: "utf-32"}
COMPLEX = 0x800
MAX_BYTES = 256 * 2**20  # of all that is unpacked and looked at
MAX_ELEMENTS = 200_000
SMALL = 2**20  # an array of numbers beyond this is an image or the like
MAX_DEPTH = 24


class Opaque(NamedTuple):
    """A variable that is a saved object: the name and class that the file gives, and what is within."""

    name: str
    class_: str
    content: Any


class Element(NamedTuple):
    """An element's type, where its data is, and where the next begins."""

    kind: int
    start: int
    end: int
    next: int


def elements(data: bytes, offset: int, order: str) -> Iterator[tuple[str, Any]]:
    """Names and values, from an offset on, leaving out large arrays of numbers.

    Structures are dictionaries (lists of them where there are many), cells are lists, characters are strings, arrays
    are arrays in MATLAB's orientation; what no camera needs (complex and sparse numbers, functions) is None.

    Parameters
    ----------
    data : bytes
    offset : int
    order : '<' or '>'
        Of the bytes in a number.

    Raises
    ------
    FileFormatError
    """
    total = 0
    while offset < len(data):
        element = _element(data, offset, len(data), order)
        if element.kind == COMPRESSED:
            part, offset = _inflated(data[element.start : element.end], order), element.end
        else:
            part, offset = data[offset : element.next], element.next
        if part and _worth_reading(part, order):
            total += len(part)
            if total > MAX_BYTES:
                raise FileFormatError(f"more than {MAX_BYTES // 2**20} MiB unpacked: not a camera file")
            reader = _Reader(part, order)
            yield reader.named(_element(part, 0, len(part), order))


def _inflated(packed: bytes, order: str) -> bytes:
    """An unpacked element, or nothing where its first bytes tell that it is not worth it."""
    try:
        machine = zlib.decompressobj()
        start = machine.decompress(packed, 4096)
        if not _worth_reading(start, order):
            return b""
        whole = start + machine.decompress(machine.unconsumed_tail, MAX_BYTES)
    except zlib.error as error:
        raise _damaged(str(error)) from None
    if machine.unconsumed_tail:
        raise FileFormatError(f"more than {MAX_BYTES // 2**20} MiB unpacked: not a camera file")
    if not machine.eof:
        raise _damaged("cut short")
    return whole


def _worth_reading(start: bytes, order: str) -> bool:
    """Whether an element may hold a camera: no large array of numbers, unless it is the nameless one of the objects."""
    kind, size, _ = _tag(start, 0, order)
    if kind != MATRIX or size <= SMALL:
        return kind == MATRIX
    flags = _element(start, 8, len(start), order)
    dimensions = _element(start, flags.next, len(start), order)
    name = _element(start, dimensions.next, len(start), order)
    class_ = _word(start, flags, order) & 0xFF
    return class_ in (CELL, STRUCT, OBJECT, OPAQUE) or name.end == name.start


def _tag(data: bytes, offset: int, order: str) -> tuple[int, int, bool]:
    """Type and number of bytes of the element there, and whether it is a short one."""
    if offset + 8 > len(data):
        raise _damaged("cut short")
    kind, size = struct.unpack_from(f"{order}II", data, offset)
    return (kind & 0xFFFF, kind >> 16, True) if kind >> 16 else (kind, size, False)


def _element(data: bytes, offset: int, end: int, order: str) -> Element:
    kind, size, short = _tag(data, offset, order)
    if short:
        if size > 4:
            raise _damaged(f"a short element of {size} bytes")
        return Element(kind, offset + 4, offset + 4 + size, offset + 8)
    start = offset + 8
    if start + size > end:
        raise _damaged(f"an element claims {size} bytes where {max(0, end - start)} are left")
    padding = 0 if kind == COMPRESSED else -size % 8
    return Element(kind, start, start + size, min(start + size + padding, end))


def _word(data: bytes, element: Element, order: str) -> int:
    """The first number of an element of 32-bit numbers."""
    if element.end - element.start < 4:
        raise _damaged("a number is missing")
    return int(struct.unpack_from(f"{order}I", data, element.start)[0])


def _damaged(what: str) -> FileFormatError:
    return FileFormatError(f"damaged .mat file: {what}")


class _Reader:
    """Reads the values within one unpacked element."""

    def __init__(self, data: bytes, order: str) -> None:
        self._data = data
        self._order = order
        self._count = 0

    def named(self, matrix: Element, depth: int = 0) -> tuple[str, Any]:
        """Name and value of a miMATRIX."""
        self._count += 1
        if depth > MAX_DEPTH or self._count > MAX_ELEMENTS:
            raise FileFormatError("too many or too deeply nested arrays: not a camera file")
        if matrix.kind != MATRIX:
            raise _damaged(f"an array of type {matrix.kind}")
        if matrix.start == matrix.end:
            return "", np.zeros((0, 0))
        flags = self._next(matrix.start, matrix)
        word = _word(self._data, flags, self._order)
        class_ = word & 0xFF
        if class_ == OPAQUE:
            found = self._opaque(flags.next, matrix, depth)
            return found.name, found
        if class_ == FUNCTION:
            return "", None
        dimensions = self._next(flags.next, matrix)
        name = self._next(dimensions.next, matrix)
        shape = self._shape(dimensions)
        value = None
        if class_ in (CELL, STRUCT, OBJECT):
            value = self._container(class_, shape, name.next, matrix, depth)
        elif class_ == CHAR:
            value = self._text(self._next(name.next, matrix))
        elif class_ != SPARSE and not word & COMPLEX:
            value = self._array(shape, self._next(name.next, matrix))
        return self._text(name), value

    def _next(self, offset: int, within: Element) -> Element:
        return _element(self._data, offset, within.end, self._order)

    def _shape(self, dimensions: Element) -> tuple[int, ...]:
        size = dimensions.end - dimensions.start
        if dimensions.kind != INT32 or size % 4 or not 8 <= size <= 32:
            raise _damaged("dimensions")
        shape = struct.unpack_from(f"{self._order}{size // 4}i", self._data, dimensions.start)
        if min(shape) < 0:
            raise _damaged("negative dimensions")
        return shape

    def _text(self, element: Element) -> str:
        if element.kind not in TEXTS:
            raise _damaged(f"text of type {element.kind}")
        encoding = TEXTS[element.kind]
        if encoding not in ("latin-1", "utf-8"):
            encoding += "-le" if self._order == "<" else "-be"
        return self._data[element.start : element.end].decode(encoding, errors="replace")

    def _array(self, shape: tuple[int, ...], element: Element) -> Any:
        if element.kind not in NUMBERS:
            raise _damaged(f"numbers of type {element.kind}")
        kind = np.dtype(f"{self._order}{NUMBERS[element.kind]}")
        if math.prod(shape) * kind.itemsize != element.end - element.start:
            raise _damaged(f"{'x'.join(map(str, shape))} numbers in {element.end - element.start} bytes")
        return np.frombuffer(self._data[element.start : element.end], kind).reshape(shape, order="F")

    def _container(self, class_: int, shape: tuple[int, ...], offset: int, matrix: Element, depth: int) -> Any:
        names = [""]
        if class_ != CELL:
            if class_ == OBJECT:
                offset = self._next(offset, matrix).next  # its class
            offset, names = self._field_names(offset, matrix)
        count = math.prod(shape)
        if count * max(1, len(names)) > max(1, (matrix.end - offset) // 8):
            raise _damaged(f"an array claims {count} elements in {matrix.end - offset} bytes")
        entries = []
        for _ in range(count):
            entry = {}
            for name in names:
                inner = self._next(offset, matrix)
                entry[name] = self.named(inner, depth + 1)[1]
                offset = inner.next
            entries.append(entry)
        if class_ == CELL:
            return [entry[""] for entry in entries]
        return entries[0] if count == 1 else entries

    def _field_names(self, offset: int, matrix: Element) -> tuple[int, list[str]]:
        """Where the values begin, and the names of the fields."""
        length = self._next(offset, matrix)
        names = self._next(length.next, matrix)
        each = _word(self._data, length, self._order)
        if not 1 <= each <= 1024 or names.kind != INT8:
            raise _damaged("field names")
        starts = range(names.start, names.end - each + 1, each)
        return names.next, [self._data[s : s + each].split(b"\0")[0].decode("latin-1") for s in starts]

    def _opaque(self, offset: int, matrix: Element, depth: int) -> Opaque:
        """A saved object: a few strings (its name, ``MCOS``, its class), then an array."""
        strings: list[str] = []
        while offset < matrix.end:
            inner = self._next(offset, matrix)
            if inner.kind == MATRIX:
                content = self.named(inner, depth + 1)[1]
                return Opaque(strings[0] if strings else "", strings[-1] if strings else "", content)
            strings.append(self._text(inner))
            offset = inner.next
        raise _damaged("an object without content")
