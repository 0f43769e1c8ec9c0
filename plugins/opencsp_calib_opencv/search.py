"""Looks for grids of corners in one level of a photograph."""

from opencsp_calib.arrays import Floats
from opencsp_calib.board import Board
from opencsp_calib_opencv.grid import count, known, trimmed
from opencsp_calib_opencv.growth import grown, pruned
from opencsp_calib_opencv.lattice import grids, links
from opencsp_calib_opencv.levels import Level
from opencsp_calib_opencv.margins import sides_seen
from opencsp_calib_opencv.neighbours import Neighbours
from opencsp_calib_opencv.saddles import corner_like, saddle_pixels
from opencsp_calib_opencv.smoothness import smooth_part

__all__ = ["found_grids"]

FEWEST_CORNERS = 6  # two rows of three: less is found in any clutter
MOST_GRIDS = 4
CLUTTER = 5000  # saddles beside the board's, in a photograph full of leaves or print
MUCH_LONGER = 2  # times as many rows or columns as the board: a tiled floor, not worth the time to complete


def found_grids(level: Level, board: Board) -> list[Floats]:
    """The grids (m, n, 2) of corners, largest first, in pixels of the level; NaN where a corner is missing.

    Those with more rows or columns than the board are not complete.
    """
    saddles = saddle_pixels(level.grey, most=CLUTTER + 2 * len(board.points))
    corners = corner_like(level.grey, saddles)
    seeds = sorted(grids(corners, links(level.grey, corners)), key=count, reverse=True)
    longest = max(board.grid)
    found: list[Floats] = []
    for seed in seeds[:MOST_GRIDS]:
        if any(_overlap(seed, grid) for grid in found):  # it has grown there from another seed already
            continue
        grid = seed
        if max(seed.shape) <= MUCH_LONGER * longest:
            grid = pruned(level.grey, seed)
            if count(grid) >= FEWEST_CORNERS:
                whole = _is_whole(level, grid, board)
                grid = trimmed(smooth_part(grid if whole else grown(level.grey, grid, saddles, longest)))
        if count(grid) >= FEWEST_CORNERS and not any(_overlap(grid, other) for other in found):
            found.append(grid)
    return sorted(found, key=count, reverse=True)


def _is_whole(level: Level, grid: Floats, board: Board) -> bool:
    """Whether the board is found to its last corner and seen to end on all sides: nothing is left to be put in."""
    complete = sorted(grid.shape[:2]) == sorted(board.grid) and bool(known(grid).all())
    return complete and all(sides_seen(level.grey, grid))


def _overlap(grid: Floats, other: Floats) -> bool:
    distance, _ = Neighbours(other[known(other)]).nearest(grid[known(grid)])
    return bool((distance < 1).mean() > 0.1)
