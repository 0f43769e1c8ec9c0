"""The elements of a version 5 .mat file: unpacked within bounds, and checked before scipy allocates by their sizes.

A file is 128 bytes of header, then elements: a tag (type, bytes) and data, padded to 8 bytes; short ones have type and
size in one word. A miMATRIX holds flags, dimensions, name, and its content, for cells and structures miMATRIX again;
miCOMPRESSED is one packed by zlib. Dimensions are believed only if as many bytes are there.

Source: MathWorks, "MAT-File Format".
"""

import math
import struct
import zlib
from typing import NamedTuple

from opencsp_calib.errors import FileFormatError

__all__ = ["check_stream", "unpacked"]

MATRIX, COMPRESSED, INT32 = 14, 15, 5
CELL, STRUCT, OBJECT, CHAR, SPARSE, FUNCTION, OPAQUE = 1, 2, 3, 4, 5, 16, 17
MAX_BYTES = 256 * 2**20  # of all that is kept, unpacked
SMALL = 2**20  # an array of numbers beyond this is an image or the like
MAX_DEPTH = 24
DAMAGED = "damaged .mat file: "


class Element(NamedTuple):
    """Where an element's data is, and where the next begins."""

    kind: int
    start: int
    end: int
    next: int


def unpacked(data: bytes) -> bytes:
    """The same file with nothing compressed, checked, without its large arrays of numbers.

    Raises
    ------
    FileFormatError
    """
    order = "<" if data[126:128] == b"IM" else ">"
    parts, total, offset = [data[:128]], 128, 128
    while offset < len(data):
        element = _element(data, offset, len(data), order)
        packed = element.kind == COMPRESSED
        part = data[offset : element.next] if not packed else _inflated(data[element.start : element.end], order)
        offset = element.end if packed else element.next
        if part and _worth_reading(part, order):
            check_stream(part, 0, order)
            parts.append(part + bytes(-len(part) % 8))
            total += len(part)
            if total > MAX_BYTES:
                raise FileFormatError(f"more than {MAX_BYTES // 2**20} MiB unpacked: not a camera file")
    return b"".join(parts)


def _inflated(packed: bytes, order: str) -> bytes:
    """An unpacked element, or nothing where its first bytes tell that it is not worth it."""
    try:
        machine = zlib.decompressobj()
        start = machine.decompress(packed, 4096)
        if not _worth_reading(start, order):
            return b""
        whole = start + machine.decompress(machine.unconsumed_tail, MAX_BYTES)
        if machine.unconsumed_tail:
            raise FileFormatError(f"more than {MAX_BYTES // 2**20} MiB unpacked: not a camera file")
    except zlib.error as error:
        raise FileFormatError(f"{DAMAGED}{error}") from None
    if not machine.eof:
        raise FileFormatError(f"{DAMAGED}cut short")
    return whole


def _worth_reading(start: bytes, order: str) -> bool:
    """Whether an element may hold a camera: no large array of numbers, unless it is the nameless one of the objects."""
    kind, size = _tag(start, 0, order)[:2]
    if kind != MATRIX:
        return False
    if size <= SMALL or len(start) < 24:
        return True
    class_ = start[16] if order == "<" else start[19]
    nameless = _class_and_name(start, order)
    return class_ in (CELL, STRUCT, OBJECT, OPAQUE) or nameless


def _class_and_name(start: bytes, order: str) -> bool:
    """Whether the array at the start has an empty name."""
    dimensions = _element(start, 24, len(start), order)
    name = _element(start, dimensions.next, len(start), order)
    return name.end == name.start


def check_stream(data: bytes, offset: int, order: str) -> None:
    """Raise FileFormatError unless all elements from an offset on are whole and claim no more than there is."""
    while offset < len(data):
        element = _element(data, offset, len(data), order)
        if element.kind == MATRIX:
            _check_matrix(data, element, order, 0)
        offset = element.next


def _tag(data: bytes, offset: int, order: str) -> tuple[int, int, bool]:
    """Type and number of bytes of the element there, and whether it is a short one."""
    if offset + 8 > len(data):
        raise FileFormatError(f"{DAMAGED}cut short")
    kind, size = struct.unpack_from(f"{order}II", data, offset)
    return (kind & 0xFFFF, kind >> 16, True) if kind >> 16 else (kind, size, False)


def _element(data: bytes, offset: int, end: int, order: str) -> Element:
    kind, size, short = _tag(data, offset, order)
    if short:
        if size > 4:
            raise FileFormatError(f"{DAMAGED}a short element of {size} bytes")
        return Element(kind, offset + 4, offset + 4 + size, offset + 8)
    start = offset + 8
    if start + size > end:
        raise FileFormatError(f"{DAMAGED}an element claims {size} bytes where {end - start} are left")
    padding = 0 if kind == COMPRESSED else -size % 8
    return Element(kind, start, start + size, min(start + size + padding, end))


def _check_matrix(data: bytes, matrix: Element, order: str, depth: int) -> None:
    if depth > MAX_DEPTH:
        raise FileFormatError(f"nested more than {MAX_DEPTH} deep: not a camera file")
    if matrix.start == matrix.end:
        return
    flags = _element(data, matrix.start, matrix.end, order)
    if flags.end - flags.start < 8:
        raise FileFormatError(f"{DAMAGED}array flags")
    class_ = struct.unpack_from(f"{order}I", data, flags.start)[0] & 0xFF
    offset, fields = flags.next, 1
    if class_ not in (OPAQUE, FUNCTION):
        dimensions = _element(data, offset, matrix.end, order)
        name = _element(data, dimensions.next, matrix.end, order)
        offset = name.next
        if class_ in (STRUCT, OBJECT):
            offset, fields = _field_count(data, offset, matrix.end, order, with_class=class_ == OBJECT)
        count = _product(data, dimensions, order) * fields
        if count > max(1, (matrix.end - offset) // (8 if class_ in (CELL, STRUCT, OBJECT) else 1)):
            raise FileFormatError(f"{DAMAGED}an array claims {count} elements in {matrix.end - offset} bytes")
    while offset < matrix.end:
        inner = _element(data, offset, matrix.end, order)
        if inner.kind == MATRIX:
            _check_matrix(data, inner, order, depth + 1)
        offset = inner.next


def _field_count(data: bytes, offset: int, end: int, order: str, *, with_class: bool) -> tuple[int, int]:
    """Where the fields' values begin, and how many fields there are."""
    if with_class:
        offset = _element(data, offset, end, order).next
    length = _element(data, offset, end, order)
    names = _element(data, length.next, end, order)
    if length.end - length.start != 4:
        raise FileFormatError(f"{DAMAGED}field name length")
    (each,) = struct.unpack_from(f"{order}i", data, length.start)
    if not 1 <= each <= 1024:
        raise FileFormatError(f"{DAMAGED}field names of {each} characters")
    return names.next, max(1, (names.end - names.start) // each)


def _product(data: bytes, dimensions: Element, order: str) -> int:
    size = dimensions.end - dimensions.start
    if dimensions.kind != INT32 or size % 4 or not 8 <= size <= 32:
        raise FileFormatError(f"{DAMAGED}dimensions")
    sides = struct.unpack_from(f"{order}{size // 4}i", data, dimensions.start)
    if min(sides) < 0:
        raise FileFormatError(f"{DAMAGED}negative dimensions")
    return math.prod(sides)
