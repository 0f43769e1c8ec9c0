"""Which corner of a found grid is the board's first: the rule that gives every view the same ids.

A grid of corners can be read from each of its ends, along its columns or its rows. Of these readings a photograph shows

- only those that are right-handed: a board is never seen from behind;
- only those with the board's number of columns and rows;
- where columns and rows are not both even or both odd, only the one with a dark outer square at id 0;
- otherwise the board looks the same upside down, and nothing in the picture tells its ends apart. Then the reading whose
  roll is in (-135, 45] degrees is taken ((-45, 45] where a quarter turn looks the same, too): the changes are far from
  the upright and the quarter-turned board, the usual ways to hold one.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats

__all__ = ["readings", "roll_deg", "square_levels"]


def readings(grid: Floats) -> Iterator[Floats]:
    """The four right-handed readings (rows, columns, 2) of a grid of pixels, NaN where there is no corner."""
    right_handed = grid if _handedness(grid) > 0 else grid[::-1]
    for turns in range(4):
        yield np.rot90(right_handed, turns)


def roll_deg(reading: Floats) -> float:
    """How far the reading is turned in the image: 0 where columns run to the right and rows run down."""
    across = np.nanmean(np.diff(reading, axis=1), axis=(0, 1))
    down = np.nanmean(np.diff(reading, axis=0), axis=(0, 1))
    x, y = across / np.linalg.norm(across) + np.array([down[1], -down[0]]) / np.linalg.norm(down)
    return float(np.degrees(np.arctan2(y, x)))


def square_levels(pixels: NDArray[np.uint8], grid: Floats) -> Floats:
    """(rows - 1, columns - 1) grey level in the middle of each square between four corners; NaN where one is missing."""
    middles = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    x, y = np.nan_to_num(np.rint(middles)).astype(int).reshape(-1, 2).T
    height, width = pixels.shape
    levels = pixels[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)].reshape(middles.shape[:2])
    return np.where(np.isnan(middles[..., 0]), np.nan, levels)


def _handedness(grid: Floats) -> float:
    across = np.nanmean(np.diff(grid, axis=1), axis=(0, 1))
    down = np.nanmean(np.diff(grid, axis=0), axis=(0, 1))
    return float(across[0] * down[1] - across[1] * down[0])


def first_corner_first(pixels: NDArray[np.uint8], grid: Floats, columns: int, rows: int) -> Floats | None:
    """The one reading (rows, columns, 2) of a grid that the rule takes; None where it has other numbers of corners."""
    fitting = [reading for reading in readings(grid) if reading.shape[:2] == (rows, columns)]
    dark_first = [reading for reading in fitting if _begins_dark(pixels, reading)]
    alike = dark_first or fitting
    first_roll_deg = -45 if len(alike) == 4 else -135
    return min(alike, key=lambda reading: (roll_deg(reading) - first_roll_deg) % 360, default=None)


def _begins_dark(pixels: NDArray[np.uint8], reading: Floats) -> bool:
    levels = square_levels(pixels, reading)
    row, column = np.indices(levels.shape)
    like_first = (row + column) % 2 == 0
    return bool(np.nanmean(levels[like_first]) < np.nanmean(levels[~like_first]))
