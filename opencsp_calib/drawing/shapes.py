"""A board as rectangles."""

from dataclasses import dataclass

from opencsp_calib.board import Checkerboard

__all__ = ["Drawing", "Rectangle", "checkerboard_drawing"]


@dataclass(frozen=True)
class Rectangle:
    """A black (or white) rectangle of a printable page.

    Parameters
    ----------
    x_m, y_m : float
        Of its upper left corner, from the page's, metres.
    width_m, height_m : float
    white : bool
        Drawn over what came before.
    """

    x_m: float
    y_m: float
    width_m: float
    height_m: float
    white: bool = False


@dataclass(frozen=True)
class Drawing:
    """A board as it is printed: rectangles on a white page, without the margin and the scale bar, which are ours.

    Parameters
    ----------
    width_m, height_m : float
    rectangles : tuple of Rectangle
        In order of drawing.
    origin_m : (float, float)
        Where on the drawing the corner with id 0 is.
    dark : bool
        The page, and so its margin, is black: for boards printed white on black.
    """

    width_m: float
    height_m: float
    rectangles: tuple[Rectangle, ...]
    origin_m: tuple[float, float]
    dark: bool = False


def checkerboard_drawing(board: Checkerboard) -> Drawing:
    """A plain checkerboard: its dark squares, one of them in the upper left corner, next to the corner with id 0."""
    columns, rows, side = board.columns + 1, board.rows + 1, board.spacing_m
    dark = [(i, j) for j in range(rows) for i in range(columns) if (i + j) % 2 == 0]
    squares = tuple(Rectangle(i * side, j * side, side, side) for i, j in dark)
    return Drawing(columns * side, rows * side, squares, (side, side))
