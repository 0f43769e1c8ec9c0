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

AT = 0.18  # of a square: from the line where the outer squares should end, dark this far inside, white this far outside
BEYOND = 0.35  # of a square: how far outside it is still white; margins are seldom narrower than half a square
NEAR = 0.3  # of the contrast, that counts as dark or white still
FEWEST_TELLING = 2  # dark squares that end where they should, while the board would go on


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
    ends = [_between(first, outer, 1 + beyond)[whole] for beyond in (-AT, AT, BEYOND)]
    inside, squares, *at_ends = sample(
        grey, np.stack([_between(second, first, 0.5)[whole], _between(first, outer, 0.5)[whole], *ends])
    )
    dark, white = np.minimum(inside, squares), np.maximum(inside, squares)
    middle = (dark.mean() + white.mean()) / 2
    telling = squares < middle  # where the next square outwards would be white, all is as if the board ended
    if telling.sum() < FEWEST_TELLING or ((inside < middle) == telling).any():
        return False
    nearest_to_white = [(level - dark) / (white - dark) for level in at_ends]
    still_dark = nearest_to_white[0][telling] < NEAR
    white_beyond = np.abs(np.array(nearest_to_white[1:]) - 1) < NEAR
    return bool(still_dark.all() and white_beyond.all() and _within(grey, ends[-1]).all())


def _between(line: Pixels, next_line: Pixels, part: float) -> Pixels:
    """(n - 1, 2) in the middle of each column of squares, so far from one line to the next."""
    moved = line + part * (next_line - line)
    return np.asarray((moved[:-1] + moved[1:]) / 2)


def _within(grey: NDArray[np.float32], pixels: Pixels) -> Mask:
    height, width = grey.shape
    return np.asarray(((pixels >= 0) & (pixels <= (width - 1, height - 1))).all(axis=1))
