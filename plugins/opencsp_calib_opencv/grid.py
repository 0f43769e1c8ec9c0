"""Arithmetic on a grid of corners: (m, n, 2) pixels, NaN where there is none."""

import numpy as np

from opencsp_calib.arrays import Floats, Mask

__all__ = ["count", "height_between", "known", "mean_known", "padded", "predicted", "square_height", "steps", "trimmed"]


def known(grid: Floats) -> Mask:
    """(m, n) whether there is a corner."""
    return np.asarray(~np.isnan(grid[..., 0]))


def count(grid: Floats) -> int:
    """How many corners there are."""
    return int(known(grid).sum())


def mean_known(one: Floats, other: Floats) -> Floats:
    """The mean of two where both are known, else the one that is; NaN where none is."""
    return np.where(np.isnan(one), other, np.where(np.isnan(other), one, (one + other) / 2))


def padded(grid: Floats, width: int) -> Floats:
    """With rows and columns of NaN all around."""
    rows, columns = grid.shape[:2]
    wider = np.full((rows + 2 * width, columns + 2 * width, 2), np.nan)
    wider[width : width + rows, width : width + columns] = grid
    return wider


def trimmed(grid: Floats) -> Floats:
    """Without the outer rows and columns that have no corner, or a single one: it would tell the grid's size alone."""
    while grid.size:
        there = known(grid)
        rows, columns = there.sum(axis=1) > 1, there.sum(axis=0) > 1
        if not (rows.any() and columns.any()):
            return grid[:0, :0]
        smaller = grid[_from_first_to_last(rows), _from_first_to_last(columns)]
        if smaller.shape == grid.shape:
            break
        grid = smaller
    return grid


def predicted(grid: Floats) -> Floats:
    """(2, m, n, 2) where each corner should be by its row and by its column; NaN where too little is known.

    Between two neighbours it is their mean; at an end, the next three in line foretell it, or two if there is no third.
    """
    around = padded(grid, 3)
    rows, columns = grid.shape[:2]

    def moved(down: int, on: int) -> Floats:
        return around[3 + down : 3 + down + rows, 3 + on : 3 + on + columns]

    lines = []
    for down, on in ((0, 1), (1, 0)):
        ends = []
        for side in (1, -1):
            first, second, third = (moved(side * k * down, side * k * on) for k in (1, 2, 3))
            straight, curved = 2 * first - second, 3 * (first - second) + third
            ends.append(np.where(np.isnan(curved), straight, curved))
        between = (moved(down, on) + moved(-down, -on)) / 2
        lines.append(np.where(np.isnan(between), mean_known(*ends), between))
    return np.stack(lines)


def steps(grid: Floats) -> tuple[Floats, Floats]:
    """(m, n, 2) the steps one row down and one column on at each corner; NaN where no neighbour is known."""
    around = padded(grid, 1)
    here = around[1:-1, 1:-1]
    down = mean_known(around[2:, 1:-1] - here, here - around[:-2, 1:-1])
    on = mean_known(around[1:-1, 2:] - here, here - around[1:-1, :-2])
    return down, on


def square_height(grid: Floats) -> Floats:
    """(m, n) px, how far an edge is from the next parallel one: the smaller height of the squares' parallelogram."""
    return height_between(*steps(grid))


def height_between(down: Floats, on: Floats) -> Floats:
    """(...) px, the smaller height of the parallelogram of two steps (..., 2)."""
    area = np.abs(down[..., 0] * on[..., 1] - down[..., 1] * on[..., 0])
    longest = np.maximum(np.linalg.norm(down, axis=-1), np.linalg.norm(on, axis=-1))
    return np.asarray(area / np.maximum(longest, 1e-12))


def _from_first_to_last(wanted: Mask) -> slice:
    places = np.nonzero(wanted)[0]
    return slice(int(places[0]), int(places[-1]) + 1)
