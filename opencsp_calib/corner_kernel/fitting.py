"""The steps of a fit, and corner after corner; see `opencsp_calib.corner_kernel`."""

import math

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel.examination import examine_opposites, examine_place, examine_quarters
from opencsp_calib.corner_kernel.image_model import differentiate
from opencsp_calib.corner_kernel.layout import CONVERGED, FAILED, OUTSIDE, PARAMETERS
from opencsp_calib.corner_kernel.machine_code import exact
from opencsp_calib.corner_kernel.normal_matrix import (
    SHARPEST_PX,
    accumulate,
    expect,
    factorise,
    solve,
    take_from_residuals,
)
from opencsp_calib.corner_kernel.window import gather

__all__ = ["fit_corners"]

SETTLED = 0.05  # of the amplitude: grey levels that change by more have not been judged yet
MOST_SWING = 0.5  # of the last step: a step back that is longer has overshot, and from then on steps are halved


@exact
def _fit(
    image: NDArray[np.uint16],
    p: Floats,
    bends: Floats,
    window: Floats,
    tolerance: float,
    most_steps: int,
    table: Floats,
    normal: Floats,
    factor: Floats,
    step: Floats,
) -> tuple[int, int]:
    """Gauss-Newton's method, a step halved until the misfit falls; status and number of pixels."""
    n, best, calm = 0, math.inf, 1.0
    step[:] = 0.0
    for _ in range(most_steps):
        n = gather(image, p, window, table)
        if n < 3 * PARAMETERS:
            return OUTSIDE, n
        weight = differentiate(p, bends[0], bends[1], window, n, table)
        accumulate(table, n, normal)
        misfit = normal[PARAMETERS, PARAMETERS] / weight
        if misfit > 1.1 * best:  # not just more: as the window moves with the corner, the root is not quite the minimum
            _take_half_back(p, step)
            continue
        best = min(best, misfit)
        expect(p, misfit, normal)
        if not factorise(normal, factor):
            return FAILED, n
        last_x, last_y = step[0], step[1]
        for k in range(len(step)):
            step[k] = normal[PARAMETERS, k]
        solve(factor, step)
        if step[0] * last_x + step[1] * last_y < -MOST_SWING * (last_x * last_x + last_y * last_y):
            calm *= 0.5
        close = math.hypot(step[0], step[1]) < tolerance and abs(step[4]) < 10 * tolerance
        close &= abs(step[5]) + abs(step[6]) < SETTLED * abs(p[6])
        _take(p, step, calm * _trusted_part(p, step))
        if close:
            take_from_residuals(table, n, step)
            return CONVERGED, n
    return FAILED, n


@exact
def _trusted_part(p: Floats, step: Floats) -> float:
    """The fraction of a step within which the model is nearly linear."""
    fraction: float = min(1.0, 1.5 / (math.hypot(step[0], step[1]) + 1e-9))
    fraction = min(fraction, 0.3 / (max(abs(step[2]), abs(step[3])) + 1e-9))
    slowest: float = 0.6 * p[4] / (abs(step[4]) + 1e-9)
    return min(fraction, slowest)


@exact
def _take(p: Floats, step: Floats, fraction: float) -> None:
    """Go a fraction of a step, which becomes what was gone."""
    for k in range(len(step)):
        step[k] *= fraction
    step[4] = max(step[4], SHARPEST_PX - p[4])
    for k in range(len(step)):
        p[k] += step[k]


@exact
def _take_half_back(p: Floats, step: Floats) -> None:
    for k in range(len(step)):
        step[k] *= 0.5
        p[k] -= step[k]


def fit_corners(
    image: NDArray[np.uint16],
    white: float,
    parameters: Floats,
    bends: Floats,
    windows: Floats,
    tolerance: float,
    most_steps: int,
    examine: bool,
    table: Floats,
    picture: Floats,
    found: Floats,
) -> None:
    """Fit corner after corner, in place.

    Parameters
    ----------
    image : (height, width) uint16
    white : float
        Grey level from which on a pixel is saturated.
    parameters : (n, 11)
        In: where to begin. Out: x, y px, angle of edge 1, of edge 2 rad, s px, a, b grey levels, and the gradients of a
        and b, in x and y, per px.
    bends : (n, 2) 1/px
        Curvature of each edge.
    windows : (n, 4) px
        Half the window along each edge; how far from an edge, in the direction of the other, pixels count at all.
    tolerance : float
        Of the position, px.
    most_steps : int
    examine : bool
        Whether all that is found is wanted, not only the status.
    table : (COLUMNS, MOST_PIXELS)
    picture : (SIDE, SIDE)
        Room to work in.
    found : (n, 23)
        In: zeros. Out: status; variance of residuals, without what is alike on opposite sides of the corner; variance
        without what is alike in neighbouring pixels; the inverse normal matrix of x and y (xx, xy,
        yy); how x, then y, responds to each edge's bend, px per 1/px; for each quarter of the window its mean residual
        over the amplitude, its share of saturated pixels, its weight (quarters 0 and 3 are opposite each other);
        variance of residuals.
    """
    normal = np.empty((PARAMETERS + 1, PARAMETERS + 1))
    factor = np.empty((PARAMETERS, PARAMETERS))
    pulls = np.empty((PARAMETERS, 2))
    step = np.empty(PARAMETERS)
    for c in range(len(parameters)):
        p, result = parameters[c], found[c]
        result[0], n = _fit(image, p, bends[c], windows[c], tolerance, most_steps, table, normal, factor, step)
        if examine and result[0] == CONVERGED:
            examine_place(p, n, table, factor, pulls, step, result)
            examine_quarters(p, n, white, table, result)
            examine_opposites(p, n, table, picture, result)
