"""A board laid out on a page at true size: with a margin that detectors need, a bar to measure, and what it is."""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.board import Board
from opencsp_calib.drawing.pattern import pattern_of
from opencsp_calib.drawing.shapes import Drawing

__all__ = ["Page", "Text", "page_of"]

LETTER = 0.6  # width of a letter of a typewriter font, as a fraction of its size
LARGEST_TEXT_M = 4e-3
BAR_LENGTHS_M = (1.0, 0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)


@dataclass(frozen=True)
class Text:
    """A line in a typewriter font.

    Parameters
    ----------
    x_m, y_m : float
        Where its first letter stands on the line, from the page's upper left corner.
    size_m : float
        Of the font.
    words : str
    """

    x_m: float
    y_m: float
    size_m: float
    words: str


@dataclass(frozen=True, eq=False)
class Page:
    """What is printed: black boxes and lines of text on white.

    Parameters
    ----------
    width_m, height_m : float
    boxes : (N, 4) m
        Left, top, right and bottom of black boxes that do not overlap, from the page's upper left corner.
    texts : tuple of Text
    """

    width_m: float
    height_m: float
    boxes: Floats
    texts: tuple[Text, ...]


def page_of(board: Board, drawing: Drawing) -> Page:
    """The page: a margin of one square around the board, black where the board is printed white on black; a foot.

    Detectors need the margin to find the outermost squares. The foot has a bar to be measured after printing, because
    printers like to scale, and the board's description, to be typed.
    """
    margin = board.spacing_m
    width = drawing.width_m + 2 * margin
    body = drawing.height_m + 2 * margin
    bar = next((length for length in BAR_LENGTHS_M if length <= width / 2), BAR_LENGTHS_M[-1])
    notes = (f"this bar is {bar * 1e3:g} mm long if printed at 100 %, not fitted to the page", board.spec)
    left = 0.25 * margin
    size = min(LARGEST_TEXT_M, (width - 2 * left) / (LETTER * max(map(len, notes))))
    lines = body + size * np.array([1.0, 2.4, 3.8])
    boxes = np.vstack([_black(drawing, margin), [left, lines[0] - 0.4 * size, left + bar, lines[0]]])
    texts = tuple(Text(left, float(y), size, words) for y, words in zip(lines[1:], notes, strict=True))
    return Page(width, float(lines[-1]) + size, boxes, texts)


def _black(drawing: Drawing, margin: float) -> Floats:
    """(N, 4) m the black parts of a drawing with its margin, in boxes that do not overlap."""
    pattern = pattern_of(drawing, margin)
    x = pattern.x_edges + drawing.origin_m[0] + margin
    y = pattern.y_edges + drawing.origin_m[1] + margin
    black = (pattern.white == 0) & (pattern.sheet == 1)
    change = np.diff(black.astype(np.int8), axis=1)
    row, first = np.nonzero(change == 1)
    _, last = np.nonzero(change == -1)
    return np.column_stack([x[first + 1], y[row], x[last + 1], y[row + 1]])
