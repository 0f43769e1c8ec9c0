"""The light on a board: how bright its squares are, where it is uneven, clipped, or reflected."""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.board import Board, CharucoBoard
from opencsp_calib.image import Image
from opencsp_calib.photograph.sampling import nearest

__all__ = ["Light", "measured_light", "square_heights"]

SATURATED = 0.995  # of the range: the last grey level of 8 bits, where cameras that clip do
GLARE_RISE = 0.25  # of the contrast: what a reflection adds to a dark square; a lamp to one side adds a tenth
LIT_PART = 0.3  # of a dark square, that a reflection covers to count
TELLING_PAIRS = 3  # of squares, that the edge of a shadow divides; dirt divides one or two


@dataclass(frozen=True)
class Light:
    """What the squares of a board show of the light on it.

    Parameters
    ----------
    contrast : float
        White minus black, of the image's range; median over the board.
    clipped : float
        Part of the white that is saturated.
    glare : float
        Part of the dark squares that a reflection lights up.
    glare_at : (float, float), optional
        Pixel of the brightest of them.
    evenness : float
        Level of the darkest white squares as a part of the brightest.
    steepest : float
        Where neighbouring white squares differ most, level of the darker as a part of the other's.
    """

    contrast: float
    clipped: float
    glare: float
    glare_at: tuple[float, float] | None
    evenness: float
    steepest: float


def measured_light(image: Image, grid: Floats, board: Board) -> Light | None:
    """The light on a board.

    Parameters
    ----------
    image : Image
    grid : (rows, columns, 2) px
        The corners, also those that were rejected; NaN where there is none.
    board : Board

    Returns
    -------
    Light or None
        None where hardly a square is to be seen.
    """
    places = _places(grid, _inside(board))
    levels = nearest(image, places)
    seen = np.isfinite(levels).all(axis=2)
    row, column = np.indices(seen.shape)
    even = seen & ((row + column) % 2 == 0)
    odd = seen & ~even
    if min(even.sum(), odd.sum()) < 2:
        return None
    dark, white = (even, odd) if np.median(levels[even]) < np.median(levels[odd]) else (odd, even)
    black_level, white_levels = float(np.median(levels[dark])), np.median(levels, axis=2)
    contrast = float(np.median(levels[white])) - black_level
    risen = (levels > black_level + GLARE_RISE * contrast).mean(axis=2)
    lit = dark & (risen > LIT_PART)
    least, most = np.percentile(white_levels[white], [5, 95])
    brightest = np.unravel_index(np.where(lit, white_levels, -1).argmax(), lit.shape)
    middle = places[brightest].mean(axis=0)
    return Light(
        contrast=contrast,
        clipped=float((levels[white] >= SATURATED).mean()),
        glare=float(lit.sum() / dark.sum()),
        glare_at=(float(middle[0]), float(middle[1])) if lit.any() else None,
        evenness=float(least / most) if most > 0 else 1.0,
        steepest=_steepest(np.where(white, white_levels, np.nan)),
    )


def square_heights(grid: Floats) -> Floats:
    """(n,) px, the smaller height of each square with four corners: how far its closer edges are apart."""
    down, on = grid[1:, :-1] - grid[:-1, :-1], grid[:-1, 1:] - grid[:-1, :-1]
    area = np.abs(down[..., 0] * on[..., 1] - down[..., 1] * on[..., 0])
    heights = area / np.maximum(np.linalg.norm(down, axis=-1), np.linalg.norm(on, axis=-1))
    return np.asarray(heights[np.isfinite(heights)])


def _inside(board: Board) -> Matrix:
    """(k, 2) where a square's colour is looked at, from (0, 0) to (1, 1): clear of its edges, and of a marker in it."""
    if isinstance(board, CharucoBoard):
        near = (1 - board.marker_m / board.spacing_m) / 4
        along = np.array([near, 0.3, 0.5, 0.7, 1 - near])
        points = np.array([(u, v) for u in along for v in along])
        return np.asarray(points[np.abs(points - 0.5).max(axis=1) > 0.5 - 2 * near])
    along = np.linspace(0.25, 0.75, 4)
    return np.array([(u, v) for u in along for v in along])


def _places(grid: Floats, inside: Matrix) -> Floats:
    """(rows - 1, columns - 1, k, 2) px, the points inside each square; NaN where a corner is missing."""
    u, v = inside.T[:, None, None, :, None]
    first, second = grid[:-1, :-1, None], grid[:-1, 1:, None]
    third, fourth = grid[1:, :-1, None], grid[1:, 1:, None]
    return np.asarray(first * (1 - u) * (1 - v) + second * u * (1 - v) + third * (1 - u) * v + fourth * u * v)


def _steepest(white: Floats) -> float:
    """The ratio of two white squares corner to corner, smallest over the board but for a few."""
    ratios = []
    for one, other in ((white[1:, 1:], white[:-1, :-1]), (white[1:, :-1], white[:-1, 1:])):
        known = np.isfinite(one + other)
        ratios.append(np.minimum(one, other)[known] / np.maximum(np.maximum(one, other)[known], 1e-9))
    every = np.sort(np.concatenate(ratios))
    return float(every[TELLING_PAIRS - 1]) if len(every) >= TELLING_PAIRS else 1.0
