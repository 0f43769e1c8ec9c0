"""Which sides of a grid of corners are the board's own, told by the white margin beyond its outer squares.

Beyond an outer row of corners there is one more row of squares. If the board goes on, dark and white alternate beyond
that, too; if it ends there, all is white.
"""

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats, Mask, Pixels
from opencsp_calib_opencv.grid import known
from opencsp_calib_opencv.rings import sample

__all__ = ["sides_seen"]

BEYOND = 0.3  # of a square: where the margin is looked at; margins are seldom narrower than half a square
NEAR_WHITE = 0.65  # of the way from dark to white that counts as white
FEWEST_TELLING = 3  # places where the board, if it went on, would be dark


def sides_seen(grey: NDArray[np.float32], grid: Floats) -> tuple[bool, bool, bool, bool]:
    """Whether the board is seen to end beyond the first row, the last column, the last row, the first column."""
    first, right, last, left = (_first_row_is_last(grey, np.rot90(grid, turns)) for turns in range(4))
    return first, right, last, left


def _first_row_is_last(grey: NDArray[np.float32], grid: Floats) -> bool:
    if len(grid) < 3:
        return False
    first, second, third = grid[:3]
    outer = 3 * (first - second) + third
    outer = np.where(np.isnan(outer), 2 * first - second, outer)
    whole = known(second)[:-1] & known(second)[1:] & known(outer)[:-1] & known(outer)[1:]
    if whole.sum() < 2 * FEWEST_TELLING:
        return False
    inside = _levels(grey, _middles(first, second, 0.5)[whole])
    squares = _levels(grey, _middles(outer, first, 0.5)[whole])
    margin_pixels = _middles(outer, first, -BEYOND)[whole]
    margin = _levels(grey, margin_pixels)
    dark, white = np.minimum(inside, squares), np.maximum(inside, squares)
    middle = (dark.mean() + white.mean()) / 2
    alternating = ((inside < middle) != (squares < middle)).all()
    telling = inside < middle
    white_beyond = margin > dark + NEAR_WHITE * (white - dark)
    return bool(
        alternating and telling.sum() >= FEWEST_TELLING and white_beyond.all() and _within(grey, margin_pixels).all()
    )


def _middles(upper: Pixels, lower: Pixels, down: float) -> Pixels:
    """(n - 1, 2) middles between neighbouring columns, `down` of the way from the upper to the lower row."""
    line = upper + down * (lower - upper)
    return np.asarray((line[:-1] + line[1:]) / 2)


def _levels(grey: NDArray[np.float32], pixels: Pixels) -> Floats:
    return sample(grey, pixels[:, None])[:, 0]


def _within(grey: NDArray[np.float32], pixels: Pixels) -> Mask:
    height, width = grey.shape
    return np.asarray(((pixels >= 0) & (pixels <= (width - 1, height - 1))).all(axis=1))
