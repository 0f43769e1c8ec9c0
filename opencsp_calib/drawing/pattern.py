"""What is printed on a board, as a table that is quick to look up."""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.drawing.shapes import Drawing, Rectangle

__all__ = ["Pattern", "pattern_of"]

SAME_M = 1e-9  # edges closer than this are one: sums of squares and of modules differ in their last digits


@dataclass(frozen=True, eq=False)
class Pattern:
    """A board's sheet cut along every edge of its drawing, in the frame of the board.

    Parameters
    ----------
    x_edges, y_edges : (M + 1,), (N + 1,) m
        Ascending, the first minus and the last plus infinity.
    white : (N, M)
        1 where the sheet is white, 0 where it is black or where there is none.
    sheet : (N, M)
        1 on the sheet, 0 beside it.
    """

    x_edges: Floats
    y_edges: Floats
    white: Floats
    sheet: Floats


def pattern_of(drawing: Drawing, margin_m: float) -> Pattern:
    """The pattern of a drawing on a sheet that is larger by a margin on all sides."""
    x0, y0 = drawing.origin_m
    page = Rectangle(-margin_m, -margin_m, drawing.width_m + 2 * margin_m, drawing.height_m + 2 * margin_m, True)
    boxes = np.array([(r.x_m, r.y_m, r.x_m + r.width_m, r.y_m + r.height_m) for r in (page, *drawing.rectangles)])
    boxes -= [x0, y0, x0, y0]
    x_edges, y_edges = _distinct(boxes[:, [0, 2]]), _distinct(boxes[:, [1, 3]])
    columns = np.searchsorted(x_edges, boxes[:, [0, 2]] - SAME_M) + 1
    rows = np.searchsorted(y_edges, boxes[:, [1, 3]] - SAME_M) + 1
    white = np.zeros((len(y_edges) + 1, len(x_edges) + 1))
    sheet = np.zeros_like(white)
    sheet[1:-1, 1:-1] = 1.0
    inks = [not drawing.dark, *(r.white for r in drawing.rectangles)]
    for (left, right), (top, bottom), ink in zip(columns, rows, inks, strict=True):
        white[top:bottom, left:right] = ink
    endless = [-np.inf], [np.inf]
    return Pattern(
        np.concatenate([endless[0], x_edges, endless[1]]),
        np.concatenate([endless[0], y_edges, endless[1]]),
        white,
        sheet,
    )


def _distinct(edges: Floats) -> Floats:
    """The sorted values, without those that follow another too closely."""
    ordered = np.sort(edges, axis=None)
    return np.asarray(ordered[np.diff(ordered, prepend=-np.inf) > SAME_M], dtype=np.float64)
