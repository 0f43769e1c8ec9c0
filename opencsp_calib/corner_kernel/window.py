"""The pixels around a corner that a fit looks at: a parallelogram along its edges."""

import math

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel.layout import LEVEL, RAMP_PX, X, Y
from opencsp_calib.corner_kernel.machine_code import exact

__all__ = ["gather"]


@exact
def _overlap(offset: float, slope: float, half: float, low: float, high: float) -> tuple[float, float]:
    """The part of an interval of x in which ``|slope x - offset| <= half``."""
    if abs(slope) < 1e-9:
        return (low, high) if abs(offset) <= half else (1.0, 0.0)
    middle, reach = offset / slope, half / abs(slope)
    return max(low, middle - reach), min(high, middle + reach)


@exact
def gather(image: NDArray[np.uint16], p: Floats, window: Floats, table: Floats) -> int:
    """Copy the window's pixels into the table, x and y from the corner on; how many, or -1 if some are outside."""
    height, width = image.shape
    x1, y1, x2, y2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    half1, half2 = window[0] + 0.5 * RAMP_PX, window[1] + 0.5 * RAMP_PX
    sine = abs(x1 * y2 - y1 * x2)
    reach_x = half1 * abs(x1) + half2 * abs(x2)
    reach_y = half1 * abs(y1) + half2 * abs(y2)
    if not (reach_x <= p[0] <= width - 1 - reach_x and reach_y <= p[1] <= height - 1 - reach_y):
        return -1
    n = 0
    for row in range(math.ceil(p[1] - reach_y), math.floor(p[1] + reach_y) + 1):
        y = row - p[1]
        low, high = _overlap(x2 * y, y2, half1 * sine, -reach_x, reach_x)
        low, high = _overlap(x1 * y, y1, half2 * sine, low, high)
        for column in range(math.ceil(low + p[0]), math.floor(high + p[0]) + 1):
            table[X, n] = column - p[0]
            table[Y, n] = y
            table[LEVEL, n] = image[row, column]
            n += 1
    return n
