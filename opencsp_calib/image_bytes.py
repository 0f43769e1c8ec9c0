"""What speaks against an image file, told from its bytes before a decoder sees them.

Decoders fill what is missing with grey and say nothing, or write lines of their own to standard error.
"""

import struct
import zlib

__all__ = ["fault"]

CUT_SHORT = "is cut short; copy it again from the camera"
DAMAGED = "is damaged, since a checksum in it is wrong; copy it again from the camera"
MOST_PAGES = 1000
MOST_ENTRIES = 500  # of a page; real ones have some twenty, and damaged ones would take minutes


def fault(data: bytes) -> str:
    """Why a file must not be used, to be read after its name; empty if nothing speaks against it."""
    if data.startswith(b"\x89PNG\r\n\x1a\n"):
        return _png_fault(data)
    if data.startswith(b"\xff\xd8"):
        return "" if b"\xff\xd9" in data[-4096:] else CUT_SHORT
    if data[:4] in (b"II*\0", b"MM\0*"):
        pages = _tiff_pages(data)
        return f"has {pages} pages; save each as a file of its own" if pages > 1 else ""
    return ""


def _png_fault(data: bytes) -> str:
    """Every chunk is its length, four letters, its content, and a checksum of letters and content."""
    view, at = memoryview(data), 8
    while at + 12 <= len(data):
        end = at + 12 + int.from_bytes(view[at : at + 4], "big")
        if end > len(data):
            return CUT_SHORT
        if zlib.crc32(view[at + 4 : end - 4]) != int.from_bytes(view[end - 4 : end], "big"):
            return DAMAGED
        if data[at + 4 : at + 8] == b"IEND":
            return ""
        at = end
    return CUT_SHORT


def _tiff_pages(data: bytes) -> int:
    """How many full-size pages a TIFF has; a preview beside the image is none.

    Every page is a directory: the number of its entries, these (tag, type, count, value), and the next one's place.
    """
    order = "<" if data.startswith(b"II") else ">"
    pages, seen = 0, set[int]()
    try:
        (at,) = struct.unpack_from(order + "I", data, 4)
        while at and at not in seen and len(seen) < MOST_PAGES:
            seen.add(at)
            (count,) = struct.unpack_from(order + "H", data, at)
            if count > MOST_ENTRIES:
                break
            entries = [struct.unpack_from(order + "HHII", data, at + 2 + 12 * index) for index in range(count)]
            kind = next((value for tag, _, _, value in entries if tag == 254), 0)
            pages += not kind & 1  # bit 0: a reduced copy of another page
            (at,) = struct.unpack_from(order + "I", data, at + 2 + 12 * count)
    except struct.error:  # cut short or damaged: the decoder says so
        pass
    return pages
