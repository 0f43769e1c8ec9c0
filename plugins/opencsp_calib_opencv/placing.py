"""Which corners of the board a found grid shows: the rule that gives every view the same ids.

A grid can be read from each of its four sides. Of these readings a photograph shows

- only right-handed ones: a board is never seen from behind;
- only those that have as many columns and rows as the board, or fewer where the board is cut off on one side and is
  seen to end on the other (`margins`);
- where columns and rows are not both even or both odd, only those with a dark outer square at id 0;
- otherwise the board looks the same upside down, and nothing in the image tells its ends apart. Then the reading
  whose roll is in [-135, 45) degrees is taken, [-45, 45) where a quarter turn looks the same, too. So the change comes
  far from the ways in which boards are held, upright or turned by a quarter.

A grid that can be placed in two ways that differ is not placed at all.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats, Ids, Pixels
from opencsp_calib.board import Board
from opencsp_calib_opencv.grid import known, steps
from opencsp_calib_opencv.margins import sides_seen
from opencsp_calib_opencv.rings import sample

__all__ = ["Placed", "placed"]


@dataclass(frozen=True, eq=False)
class Placed:
    """Corners of a board that a grid was found to show.

    Parameters
    ----------
    ids : (n,)
    pixels : (n, 2)
    square_px : float
        Side of a square, pixels: the median root of its area.
    """

    ids: Ids
    pixels: Pixels
    square_px: float


@dataclass(frozen=True, eq=False)
class _Reading:
    """One way to read a grid.

    Parameters
    ----------
    ids : (m, n)
        Of the grid's corners, as it lies.
    certain : bool
        Whether both its place along the rows and along the columns are told by numbers or margins.
    dark_first : bool
        Whether the board would have a dark outer square at id 0.
    roll_deg : float
    """

    ids: Ids
    certain: bool
    dark_first: bool
    roll_deg: float


def placed(grey: NDArray[np.float32], grid: Floats, board: Board) -> Placed | None:
    """The corners of the board that the grid shows; None where it does not fit, or fits in ways that differ."""
    columns, rows = board.grid
    if max(grid.shape[:2]) > max(rows, columns) or min(grid.shape[:2]) > min(rows, columns):
        return None
    grid = grid if _handedness(grid) > 0 else grid[::-1]
    whole = sorted(grid.shape[:2]) == sorted((rows, columns))
    readings = list(_readings(grey, grid, board, whole))
    dark_first = [reading for reading in readings if reading.dark_first]
    readings = dark_first or (readings if whole else [])
    alike = _symmetries(board)
    if not readings or not all(r.certain and _same(readings[0].ids, r.ids, alike) for r in readings):
        return None
    from_deg = -45 if len(readings) == 4 else -135
    ids = min(readings, key=lambda reading: (reading.roll_deg - from_deg) % 360).ids
    there = known(grid)
    order = np.argsort(ids[there])
    return Placed(ids[there][order], grid[there][order], _square_px(grid))


def _readings(grey: NDArray[np.float32], grid: Floats, board: Board, whole: bool) -> Iterator[_Reading]:
    """All readings that nothing in the image speaks against; where the whole board is, its size tells its place."""
    columns, rows = board.grid
    all_ids = np.arange(columns * rows).reshape(rows, columns)
    sides = (False,) * 4 if whole else sides_seen(grey, grid)
    down, on = _mean_steps(grid)
    for turns, begins_dark in enumerate(_begin_dark(grey, grid)):
        height, width = grid.shape[:2] if turns % 2 == 0 else grid.shape[1::-1]
        top, right, bottom, left = (sides[(side + turns) % 4] for side in range(4))
        first_rows, first_columns = _offsets(height, rows, top, bottom), _offsets(width, columns, left, right)
        certain = len(first_rows) == len(first_columns) == 1
        roll_deg = _roll_deg(down, on)
        for row, column in product(first_rows, first_columns):
            ids = all_ids[row : row + height, column : column + width]
            dark_first = begins_dark == ((row + column) % 2 == 0)
            yield _Reading(np.rot90(ids, -turns), certain, dark_first, roll_deg)
        down, on = -on, down  # as `rot90` turns the grid


def _offsets(found: int, wanted: int, begins: bool, ends: bool) -> Sequence[int]:
    """Which of the board's lines the first one found may be, where the board is seen to begin or to end."""
    if found == wanted:
        return [0]
    if found > wanted or (begins and ends):
        return []
    if not (begins or ends):
        return range(wanted - found + 1)
    return [0] if begins else [wanted - found]


def _symmetries(board: Board) -> list[Ids]:
    """For each turn after which the board looks the same, what each id becomes."""
    columns, rows = board.grid
    ids = np.arange(columns * rows).reshape(rows, columns)
    turns = [0]
    if (columns + rows) % 2 == 0:
        turns = [0, 1, 2, 3] if columns == rows and columns % 2 == 0 else [0, 2]
    return [np.rot90(ids, n).ravel() for n in turns]


def _same(one: Ids, other: Ids, alike: list[Ids]) -> bool:
    return any(np.array_equal(turned[one], other) for turned in alike)


def _begin_dark(grey: NDArray[np.float32], grid: Floats) -> list[bool]:
    """Whether the squares like the one at the first corner are the dark ones, at 0 to 3 quarter turns of the grid."""
    middles = (grid[:-1, :-1] + grid[1:, :-1] + grid[:-1, 1:] + grid[1:, 1:]) / 4
    row, column = np.nonzero(known(middles))
    levels = sample(grey, middles[row, column][:, None])[:, 0]
    even = (row + column) % 2 == 0
    even_dark = bool(levels[even].mean() < levels[~even].mean())
    down, on = middles.shape[0] - 1, middles.shape[1] - 1
    return [even_dark == (place % 2 == 0) for place in (0, on, down + on, down)]


def _mean_steps(grid: Floats) -> tuple[Floats, Floats]:
    """(2,) px one row down, and one column on, on average."""
    down, on = (np.nanmean(step, axis=(0, 1)) for step in steps(grid))
    return down, on


def _handedness(grid: Floats) -> float:
    down, on = _mean_steps(grid)
    return float(on[0] * down[1] - on[1] * down[0])


def _roll_deg(down: Floats, on: Floats) -> float:
    """How far a reading is turned in the image: 0 where columns run to the right and rows run down."""
    x, y = on / np.linalg.norm(on) + np.array([down[1], -down[0]]) / np.linalg.norm(down)
    return float(np.degrees(np.arctan2(y, x)))


def _square_px(grid: Floats) -> float:
    down, on = steps(grid)
    area = np.abs(down[..., 0] * on[..., 1] - down[..., 1] * on[..., 0])
    return float(np.sqrt(np.nanmedian(area)))
