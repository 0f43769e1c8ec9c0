"""What a fit tells beside the place: how sure it is, and what disturbs it."""

import math

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel.layout import LEVEL, PARAMETERS, RESIDUAL, ROOT, SIDE, X, Y
from opencsp_calib.corner_kernel.machine_code import exact, fast, unsigned
from opencsp_calib.corner_kernel.normal_matrix import solve

__all__ = ["examine_opposites", "examine_place", "examine_quarters"]


@fast
def _pull(p: Floats, n: int, table: Floats, pulls: Floats) -> None:
    """How hard each edge's bend pulls at each parameter: its derivative's products with the others."""
    x1, y1, x2, y2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    xs, ys, by_angle1, by_angle2 = table[X], table[Y], table[2], table[3]
    for i in range(len(pulls)):
        column = table[i]
        pull1 = pull2 = 0.0
        for k in range(unsigned(n)):
            x, y = xs[k], ys[k]
            pull1 += column[k] * by_angle1[k] * (x * x1 + y * y1)
            pull2 += column[k] * by_angle2[k] * (x * x2 + y * y2)
        pulls[i, 0], pulls[i, 1] = 0.5 * pull1, 0.5 * pull2


@exact
def examine_place(p: Floats, n: int, table: Floats, factor: Floats, pulls: Floats, row: Floats, found: Floats) -> None:
    """The inverse normal matrix of x and y, and their response to bends."""
    _pull(p, n, table, pulls)
    for coordinate in range(2):
        for k in range(len(row)):
            row[k] = 1.0 if k == coordinate else 0.0
        solve(factor, row)
        found[3 + coordinate], found[4 + coordinate] = row[0], row[1]
        for edge in range(2):
            for k in range(len(row)):
                found[6 + 2 * coordinate + edge] += row[k] * pulls[k, edge]


@exact
def examine_quarters(p: Floats, n: int, white: float, table: Floats, found: Floats) -> None:
    """Each quarter's mean residual, over the amplitude, and its share of saturated pixels."""
    x1, y1, x2, y2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    xs, ys, levels, residuals, roots = table[X], table[Y], table[LEVEL], table[RESIDUAL], table[ROOT]
    total = 0.0
    for k in range(unsigned(n)):
        x, y, root = xs[k], ys[k], roots[k]
        total += residuals[k] ** 2
        quarter = (2 if y * x1 > x * y1 else 0) + (1 if y * x2 > x * y2 else 0)
        found[10 + quarter] += root * residuals[k]
        found[14 + quarter] += root * root if levels[k] >= white else 0.0
        found[18 + quarter] += root * root
    for quarter in range(4):
        found[10 + quarter] /= max(found[18 + quarter], 1.0) * max(abs(p[6]), 1e-9)
        found[14 + quarter] /= max(found[18 + quarter], 1.0)
    found[22] = total / max(found[18] + found[19] + found[20] + found[21] - PARAMETERS, 1.0)


@fast
def examine_opposites(p: Floats, n: int, table: Floats, picture: Floats, found: Floats) -> None:
    """How much residuals differ from those on the opposite side of the corner, and from those beside them.

    The opposite of a pixel lies between four; where between them is the same for all pixels.
    """
    first_row, last_row, first_column, last_column = _lay_out(p, n, table, picture)
    right, down = 2 * p[0] - math.floor(2 * p[0]), 2 * p[1] - math.floor(2 * p[1])
    opposite_row = math.floor(2 * p[1]) - 2 * (math.floor(p[1]) - SIDE // 2)
    opposite_column = unsigned(math.floor(2 * p[0]) - 2 * (math.floor(p[0]) - SIDE // 2))
    unlike = opposites = beside = neighbours = 0.0
    for row in range(first_row, last_row + 1):
        here, above, below = picture[row], picture[opposite_row - row], picture[opposite_row - row + 1]
        for column in range(unsigned(first_column), unsigned(last_column + 1)):
            before = opposite_column - column
            after = before + unsigned(1)
            upper = (1 - right) * above[before] + right * above[after]
            lower = (1 - right) * below[before] + right * below[after]
            difference = here[column] - (1 - down) * upper - down * lower
            unlike += 0.0 if math.isnan(difference) else difference * difference
            opposites += 0.0 if math.isnan(difference) else 1.0
            step = here[column] - here[column + unsigned(1)]
            beside += 0.0 if math.isnan(step) else step * step
            neighbours += 0.0 if math.isnan(step) else 1.0
    gain = 1.0 + ((1 - right) ** 2 + right**2) * ((1 - down) ** 2 + down**2)
    # four parameters took their share of what is not alike on opposite sides: half of all freedoms
    found[1] = unlike / gain / (opposites - 8) if opposites > 40 else found[22]
    found[2] = beside / 2 / max(neighbours, 1.0)


@exact
def _lay_out(p: Floats, n: int, table: Floats, picture: Floats) -> tuple[int, int, int, int]:
    """Lay out the residuals as a picture, NaN around them; first and last row, first and last column."""
    left, top = math.floor(p[0]) - SIDE // 2, math.floor(p[1]) - SIDE // 2
    xs, ys, residuals, roots = table[X], table[Y], table[RESIDUAL], table[ROOT]
    picture[:] = math.nan
    first_column, last_column = SIDE, 0
    row = 0
    for k in range(unsigned(n)):
        row = math.floor(ys[k] + p[1] + 0.5) - top
        column = math.floor(xs[k] + p[0] + 0.5) - left
        first_column, last_column = min(first_column, column), max(last_column, column)
        if roots[k] > 0.999:
            picture[row, column] = residuals[k]
    return math.floor(ys[0] + p[1] + 0.5) - top, row, first_column, last_column
