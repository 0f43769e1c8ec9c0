"""What a corner's neighbours on the board tell about it: the way its edges run, the size of its squares, their bend."""

from collections.abc import Iterator

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Mask, Pixels

__all__ = ["bends", "displaced", "edges", "parity"]

ROBUST_STEPS = 5
SINGULAR = 1e-12  # of the largest eigenvalue
LEAST_DISPLACED_PX, LEAST_DISPLACED_DEVIATIONS = 0.5, 10.0


def parity(ids: Ids, columns: int) -> Floats:
    """(n,) +1 where the squares before and after a corner are coloured as they are at corner 0, -1 where exchanged."""
    row, column = np.divmod(ids, columns)
    return 1.0 - 2.0 * ((row + column) % 2)


def edges(pixels: Pixels, ids: Ids, columns: int) -> tuple[Floats, Floats]:
    """The two edges that cross in each corner.

    Parameters
    ----------
    pixels : (n, 2)
    ids : (n,) int
    columns : int
        Of the board's corners.

    Returns
    -------
    vectors : (n, 2, 2) px
        From a corner to the next one along its row, and along its column. Where a corner has no neighbour that way, the
        nearest corner's that has one; NaN where there is none.
    lengths : (n, 2) px
        To the nearer of the two neighbours along the row, and along the column.
    """
    grid = _placed(pixels, ids, columns)
    vectors, lengths = np.empty((len(ids), 2, 2)), np.empty((len(ids), 2))
    for axis, (before, after) in enumerate(_neighbours(grid, ids, columns)):
        steps = np.stack([pixels - before, after - pixels])
        known = np.isfinite(steps.sum(axis=2, keepdims=True))
        with np.errstate(invalid="ignore"):
            vectors[:, axis] = np.where(known, steps, 0).sum(axis=0) / known.sum(axis=0)
        norms = np.where(known.reshape(2, -1), np.linalg.norm(steps, axis=2), np.inf)
        lengths[:, axis] = norms.min(axis=0)
        alone = ~known.any(axis=0).ravel()
        if alone.any() and not alone.all():
            nearest = _nearest(ids[alone], ids[~alone], columns)
            vectors[alone, axis] = vectors[~alone, axis][nearest]
            lengths[alone, axis] = lengths[~alone, axis][nearest]
    return vectors, lengths


def bends(pixels: Pixels, ids: Ids, columns: int) -> tuple[Floats, Floats]:
    """How much distortion bends the edges at each corner, from how rows and columns of corners bend.

    A corner's own window tells its edges' bend badly, and not knowing it costs a third of the accuracy; the whole
    board tells it well, because distortion changes slowly: a cubic of the corner's place on the board is fitted to the
    second differences of neighbours, outliers set aside.

    Parameters
    ----------
    pixels, ids, columns
        See `edges`.

    Returns
    -------
    bends, deviations : (n, 2) 1/px
        Curvature of the edge along the row and along the column, positive where it bends from its direction towards
        that direction turned by a quarter from x to y; and how well that is known.
    """
    grid = _placed(pixels, ids, columns)
    row, column = np.divmod(ids, columns)
    values, deviations = np.zeros((len(ids), 2)), np.zeros((len(ids), 2))
    for axis, (before, after) in enumerate(_neighbours(grid, ids, columns)):
        along = (after - before) / 2
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
        length = np.linalg.norm(along, axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):  # two corners in one place
            measured = ((before + after - 2 * pixels) * normal).sum(axis=1) / length**3
        values[:, axis], deviations[:, axis] = _smoothed(measured, row, column)
    return values, deviations


def displaced(pixels: Pixels, ids: Ids, columns: int) -> Mask:
    """(n,) whether a corner is not where its neighbours place it, as judged by how well others are where theirs do.

    One corner that is off by d bends its row by -d at its own place and by d/2 on both sides, whatever distortion and
    perspective do, which change slowly. The largest of such a group is the culprit.
    """
    off = np.zeros(len(ids), dtype=bool)
    for axis, (before, after) in enumerate(_neighbours(_placed(pixels, ids, columns), ids, columns)):
        along = after - before
        normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):  # two corners in one place
            offset = ((pixels - (before + after) / 2) * normal).sum(axis=1) / np.linalg.norm(along, axis=1)
        others = _beside(offset, ids, columns, axis)
        count = np.maximum(np.isfinite(others).sum(axis=0), 1)
        size = np.abs(offset - np.nan_to_num(others).sum(axis=0) / count) / np.sqrt(1 + 1 / count)
        known = np.isfinite(size)
        if known.any():
            usual = 1.4826 * float(np.median(size[known]))
            largest = ~(_beside(size, ids, columns, axis) > size).any(axis=0)
            off |= (size > max(LEAST_DISPLACED_PX, LEAST_DISPLACED_DEVIATIONS * usual)) & largest
    return off


def _placed(values: Floats, ids: Ids, columns: int) -> Floats:
    """(rows + 2, columns + 2, ...), NaN where there is no corner, and all around."""
    grid = np.full((int(ids.max()) // columns + 3, columns + 2, *values.shape[1:]), np.nan)
    row, column = np.divmod(ids, columns)
    grid[row + 1, column + 1] = values
    return grid


def _beside(values: Floats, ids: Ids, columns: int, axis: int) -> Floats:
    """(2, n) the values (n,) of the corners before and after each along an axis, NaN where there is none."""
    before_and_after = list(_neighbours(_placed(values, ids, columns), ids, columns))
    return np.stack(before_and_after[axis])


def _neighbours(grid: Floats, ids: Ids, columns: int) -> Iterator[tuple[Floats, Floats]]:
    """Before and after each corner: along its row, then along its column."""
    row, column = np.divmod(ids, columns)
    yield grid[row + 1, column], grid[row + 1, column + 2]
    yield grid[row, column + 1], grid[row + 2, column + 1]


def _nearest(ids: Ids, others: Ids, columns: int) -> Ids:
    """Which of the others is nearest on the board to each."""
    row, column = np.divmod(ids, columns)
    other_row, other_column = np.divmod(others, columns)
    distance = np.abs(row[:, None] - other_row) + np.abs(column[:, None] - other_column)
    return np.asarray(distance.argmin(axis=1))


def _smoothed(measured: Floats, row: Ids, column: Ids) -> tuple[Floats, Floats]:
    """A robust polynomial of the place on the board, and its deviation; zeros where too little is known."""
    known = np.isfinite(measured)
    n = int(known.sum())
    if n < 3:
        return np.zeros(len(row)), np.zeros(len(row))
    # three times as many values as coefficients, at the least
    degree = max(d for d in range(4) if (d + 1) * (d + 2) // 2 * 3 <= n)
    x, y = row / (np.ptp(row) + 1) - 0.5, column / (np.ptp(column) + 1) - 0.5
    terms = np.stack([x**i * y**j for i in range(degree + 1) for j in range(degree + 1 - i)], axis=1)
    basis = _orthonormal(terms[known])
    design, values = terms[known] @ basis, measured[known]
    weights = np.ones(n)
    for _ in range(ROBUST_STEPS):
        weighted = design * weights[:, None]
        inverse = np.linalg.inv(weighted.T @ design)
        residuals = values - design @ (inverse @ (weighted.T @ values))
        scale = 1.4826 * float(np.median(np.abs(residuals))) + 1e-12
        weights = 1 / (1 + (residuals / (2 * scale)) ** 2)
    coefficients = basis @ (inverse @ (weighted.T @ values))
    spread = terms @ basis
    return terms @ coefficients, scale * np.sqrt(((spread @ inverse) * spread).sum(axis=1))


def _orthonormal(terms: Floats) -> Floats:
    """What to multiply the terms by to make their columns orthonormal, less those that others make up."""
    sizes, axes = np.linalg.eigh(terms.T @ terms)
    told_apart = sizes > SINGULAR * sizes[-1]
    return np.asarray(axes[:, told_apart] / np.sqrt(sizes[told_apart]))
