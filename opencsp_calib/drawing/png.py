"""A page as PNG at 300 dots an inch, with its true size noted in the file.

Source: W3C, Portable Network Graphics (PNG) Specification, sections 5 (chunks), 11.2 and 11.3.5.3 (pHYs).
"""

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats
from opencsp_calib.drawing.page import Page, Text
from opencsp_calib.errors import InputError

__all__ = ["write_png"]

DOTS_A_METRE = 11811  # 300 an inch
MOST_DOTS = 1_000_000_000
BAND = 256  # rows at a time: a large board has more dots than memory should hold


def write_png(page: Page, path: Path) -> None:
    """Write a page in grey: a dot that is black in part has the grey level of that part.

    Raises
    ------
    InputError
        If the page would have too many dots.
    """
    width, height = round(page.width_m * DOTS_A_METRE), round(page.height_m * DOTS_A_METRE)
    if width * height > MOST_DOTS:
        raise InputError(f"as .png the board would have {width}x{height} dots; write it as .pdf or .svg")
    texts = [(text, _letters(text)) for text in page.texts]
    packer = zlib.compressobj(6)
    with path.open("wb") as file:
        file.write(b"\x89PNG\r\n\x1a\n")
        file.write(_chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)))
        file.write(_chunk(b"pHYs", struct.pack(">IIB", DOTS_A_METRE, DOTS_A_METRE, 1)))
        for band in _bands(page, texts, width, height):
            rows = np.zeros((len(band), width + 1), dtype=np.uint8)  # each row begins with its filter, none
            rows[:, 1:] = band
            file.write(_chunk(b"IDAT", packer.compress(rows.tobytes())))
        file.write(_chunk(b"IDAT", packer.flush()))
        file.write(_chunk(b"IEND", b""))


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def _bands(page: Page, texts: list[tuple[Text, Floats]], width: int, height: int) -> Iterator[NDArray[np.uint8]]:
    """Grey levels, some rows at a time."""
    boxes = page.boxes * DOTS_A_METRE
    for top in range(0, height, BAND):
        rows = min(BAND, height - top)
        black = np.zeros((rows, width), dtype=np.float32)
        for left, upper, right, lower in boxes[(boxes[:, 1] < top + rows) & (boxes[:, 3] > top)]:
            first, last = int(left), min(int(np.ceil(right)), width)
            up, down = max(int(upper) - top, 0), min(int(np.ceil(lower)) - top, rows)
            part_x, part_y = _covered(left, right, first, last), _covered(upper - top, lower - top, up, down)
            black[up:down, first:last] += np.outer(part_y, part_x)
        for text, letters in texts:
            _paste(black, letters, round(text.x_m * DOTS_A_METRE), round(text.y_m * DOTS_A_METRE) - top)
        yield np.rint(255.0 * (1.0 - np.clip(black, 0.0, 1.0))).astype(np.uint8)


def _covered(start: float, end: float, first: int, last: int) -> Floats:
    """The part of each dot from first to last that lies between start and end."""
    dots = np.arange(first, last, dtype=np.float64)
    return np.asarray(np.clip(np.minimum(end, dots + 1.0) - np.maximum(start, dots), 0.0, 1.0), dtype=np.float64)


def _paste(black: NDArray[np.float32], letters: Floats, x: int, line: int) -> None:
    """Letters on a line, as far as they lie in the band; they hang a quarter of their box below the line."""
    top = line - round(0.75 * len(letters))
    up, down = max(top, 0), min(top + len(letters), len(black))
    wide = min(letters.shape[1], black.shape[1] - x)
    if up < down:
        black[up:down, x : x + wide] = np.maximum(black[up:down, x : x + wide], letters[up - top : down - top, :wide])


def _letters(text: Text) -> Floats:
    """How black the dots of a line of text are, in a box of 4/3 of the font's size, its line at three quarters."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    size = text.size_m * DOTS_A_METRE
    inches = (0.62 * text.size_m * len(text.words) / 0.0254, 4.0 / 3.0 * text.size_m / 0.0254)
    figure = Figure(figsize=inches, dpi=300)
    canvas: Any = FigureCanvasAgg(figure)  # its methods have no types
    figure.text(0.0, 0.25, text.words, family="monospace", fontsize=size * 72.0 / 300.0, parse_math=False)
    canvas.draw()
    return 1.0 - np.asarray(canvas.buffer_rgba())[..., 0] / 255.0
