"""What a fit tells beside the place: how sure it is, and what disturbs it."""

import math

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel.layout import LEVEL, PARAMETERS, PLACED, RESIDUAL, ROOT, SIDE, STRIDE, X, Y
from opencsp_calib.corner_kernel.machine_code import exact, fast
from opencsp_calib.corner_kernel.normal_matrix import solve

__all__ = ["examine_opposites", "examine_place", "examine_quarters"]


@fast
def _pull(p: Floats, n: int, work: Floats, pulls: Floats) -> None:
    """How hard each edge's bend pulls at each parameter: its derivative's products with the others."""
    x1, y1, x2, y2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    for i in range(len(pulls)):
        pull1 = pull2 = 0.0
        for k in range(n):
            x, y, column = work[X + k], work[Y + k], work[i * STRIDE + k]
            pull1 += column * work[2 * STRIDE + k] * (x * x1 + y * y1)
            pull2 += column * work[3 * STRIDE + k] * (x * x2 + y * y2)
        pulls[i, 0], pulls[i, 1] = 0.5 * pull1, 0.5 * pull2


@exact
def examine_place(p: Floats, n: int, work: Floats, factor: Floats, pulls: Floats, row: Floats, found: Floats) -> None:
    """The inverse normal matrix of x and y, and their response to bends."""
    _pull(p, n, work, pulls)
    for coordinate in range(2):
        for k in range(len(row)):
            row[k] = 1.0 if k == coordinate else 0.0
        solve(factor, row)
        found[3 + coordinate], found[4 + coordinate] = row[0], row[1]
        for edge in range(2):
            for k in range(len(row)):
                found[6 + 2 * coordinate + edge] += row[k] * pulls[k, edge]


@exact
def examine_quarters(p: Floats, n: int, white: float, work: Floats, found: Floats) -> None:
    """Each quarter's mean residual, over the amplitude, and its share of saturated pixels."""
    x1, y1, x2, y2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    total = 0.0
    for k in range(n):
        x, y, root = work[X + k], work[Y + k], work[ROOT + k]
        total += work[RESIDUAL + k] ** 2
        quarter = (2 if y * x1 > x * y1 else 0) + (1 if y * x2 > x * y2 else 0)
        found[10 + quarter] += root * work[RESIDUAL + k]
        found[14 + quarter] += root * root if work[LEVEL + k] >= white else 0.0
        found[18 + quarter] += root * root
    for quarter in range(4):
        found[10 + quarter] /= max(found[18 + quarter], 1.0) * max(abs(p[6]), 1e-9)
        found[14 + quarter] /= max(found[18 + quarter], 1.0)
    found[22] = total / max(found[18] + found[19] + found[20] + found[21] - PARAMETERS, 1.0)


@exact
def examine_opposites(p: Floats, n: int, work: Floats, found: Floats) -> None:
    """How much residuals differ from those on the opposite side of the corner, and from those beside them.

    The opposite of a pixel lies between four; where between them is the same for all pixels.
    """
    left, top = math.floor(p[0]) - SIDE // 2, math.floor(p[1]) - SIDE // 2
    for k in range(SIDE * SIDE):
        work[PLACED + k] = math.nan
    for k in range(n):
        if work[ROOT + k] > 0.999:
            place = (round(work[Y + k] + p[1]) - top) * SIDE + round(work[X + k] + p[0]) - left
            work[PLACED + place] = work[RESIDUAL + k]
    right, down = 2 * p[0] - math.floor(2 * p[0]), 2 * p[1] - math.floor(2 * p[1])
    mirror = math.floor(2 * p[0]) - 2 * left + SIDE * (math.floor(2 * p[1]) - 2 * top)
    gain = 1.0 + ((1 - right) ** 2 + right**2) * ((1 - down) ** 2 + down**2)
    unlike = beside = 0.0
    opposites = neighbours = 0
    for k in range(n):
        place = (round(work[Y + k] + p[1]) - top) * SIDE + round(work[X + k] + p[0]) - left
        value, other = work[PLACED + place], mirror - place
        if math.isnan(value) or not 0 <= other < SIDE * (SIDE - 1) - 1:
            continue
        upper = (1 - right) * work[PLACED + other] + right * work[PLACED + other + 1]
        lower = (1 - right) * work[PLACED + other + SIDE] + right * work[PLACED + other + SIDE + 1]
        difference = value - (1 - down) * upper - down * lower
        if not math.isnan(difference):
            unlike += difference**2 / gain
            opposites += 1
        step = value - work[PLACED + place + 1]
        if not math.isnan(step):
            beside += step**2 / 2
            neighbours += 1
    # four parameters took their share of what is not alike on opposite sides: half of all freedoms
    found[1] = unlike / (opposites - 8) if opposites > 40 else found[22]
    found[2] = beside / max(neighbours, 1)
