"""The image of a corner: ``a + b u v``, and its derivatives.

u and v are the profiles, from -1 to 1, of two edges that cross in the corner: a step seen through a Gaussian of
deviation s. What the product lacks is added to first order: for the pixel's own area, which is no Gaussian, by the
Gram-Charlier series with the fourth cumulant of a box; for edges that are not perpendicular, by the tetrachoric series
of the bivariate normal distribution. Edges may be bent, by a curvature that is given. a and b have gradients: light
that changes across the board scales both, a reflection is added.
"""

import math

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel.layout import LEVEL, RAMP_PX, RESIDUAL, X, Y
from opencsp_calib.corner_kernel.machine_code import fast, unsigned

__all__ = ["differentiate"]


@fast
def _profile(z: float, kurtosis: float) -> tuple[float, float]:
    """The image of an edge (-1 to 1) and its derivative, at z deviations from the edge.

    The exponential is Taylor's polynomial of a 32nd of its argument, squared five times (within 2e-6); the error
    function is 7.1.26 of Abramowitz and Stegun (within 2e-7). Both are free of branches.
    """
    y = min(0.5 * z * z, 20.0) / 32
    bell = 1.0 - y * (1.0 - y / 2 * (1.0 - y / 3 * (1.0 - y / 4)))
    bell = bell * bell
    bell = bell * bell
    bell = bell * bell
    bell = bell * bell
    bell = bell * bell
    t = 1.0 / (1.0 + 0.23164188 * abs(z))
    tail = t * (0.254829592 + t * (-0.284496736 + t * (1.421413741 + t * (-1.453152027 + t * 1.061405429)))) * bell
    density = 0.3989422804014327 * bell
    z2 = z * z
    value = math.copysign(1.0 - tail, z) - kurtosis * z * (z2 - 3.0) * density
    return value, (2.0 + kurtosis * (z2 * (z2 - 6.0) + 3.0)) * density


@fast
def differentiate(p: Floats, bend1: float, bend2: float, window: Floats, n: int, table: Floats) -> float:
    """Fill the columns: residual and derivatives, each times the root of the pixel's weight; the sum of weights."""
    s, b, b_x, b_y = p[4], p[6], p[9], p[10]
    x1, y1, x2, y2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    cosine, sine = x1 * x2 + y1 * y2, x1 * y2 - y1 * x2
    # the fourth cumulant of a box of width w is -w^4/120; over 12, see _profile
    box = -1.0 / (1440.0 * max(s, 0.4) ** 4)
    kurtosis1, kurtosis2 = box * (x1**4 + y1**4), box * (x2**4 + y2**4)
    limit1, limit2, clear1, clear2 = window[0] / RAMP_PX + 0.5, window[1] / RAMP_PX + 0.5, window[2], window[3]
    by_x, by_y, by_angle1, by_angle2, by_s, by_a, by_b = (
        table[0], table[1], table[2], table[3], table[4], table[5], table[6],
    )  # fmt: skip
    xs, ys = table[X], table[Y]
    total = 0.0
    for k in range(unsigned(n)):
        x, y = xs[k], ys[k]
        across1, across2 = y * x1 - x * y1, y * x2 - x * y2
        along1, along2 = abs(across2 / sine), abs(across1 / sine)
        weight = min(max(limit1 - along1 / RAMP_PX, 0.0), 1.0) * min(max(limit2 - along2 / RAMP_PX, 0.0), 1.0)
        weight *= min(max(max(clear1 - along1, clear2 - along2), 0.0), 1.0)
        total += weight
        root = math.sqrt(weight)
        turn1, turn2 = x * x1 + y * y1, x * x2 + y * y2
        z1 = (across1 - 0.5 * bend1 * turn1 * turn1) / s
        z2 = (across2 - 0.5 * bend2 * turn2 * turn2) / s
        u, du = _profile(z1, kurtosis1)
        v, dv = _profile(z2, kurtosis2)
        skew, more = cosine * du * dv, 1.0 + 0.5 * cosine * z1 * z2
        height = root * (b + b_x * x + b_y * y)
        slope1 = height / s * (du * v + skew * (0.5 * cosine * z2 - z1 * more))
        slope2 = height / s * (u * dv + skew * (0.5 * cosine * z1 - z2 * more))
        shear = height * sine * du * dv * (1.0 + cosine * z1 * z2)
        by_x[k] = slope1 * y1 + slope2 * y2
        by_y[k] = -slope1 * x1 - slope2 * x2
        by_angle1[k] = shear - slope1 * turn1
        by_angle2[k] = -shear - slope2 * turn2
        by_s[k] = -(slope1 * z1 + slope2 * z2)
        by_a[k] = root
        by_b[k] = root * (u * v + skew * more)
    _light(p, n, table)
    return total


@fast
def _light(p: Floats, n: int, table: Floats) -> None:
    """Fill the columns of the gradients and the residual; a loop of its own, for the compiler's hundred pairs."""
    a, b, a_x, a_y, b_x, b_y = p[5], p[6], p[7], p[8], p[9], p[10]
    by_a, by_b, by_a_x, by_a_y, by_b_x, by_b_y = table[5], table[6], table[7], table[8], table[9], table[10]
    xs, ys, levels, residuals = table[X], table[Y], table[LEVEL], table[RESIDUAL]
    for k in range(unsigned(n)):
        x, y, root, pattern = xs[k], ys[k], by_a[k], by_b[k]
        by_a_x[k] = root * x
        by_a_y[k] = root * y
        by_b_x[k] = pattern * x
        by_b_y[k] = pattern * y
        residuals[k] = root * (levels[k] - a - a_x * x - a_y * y) - pattern * (b + b_x * x + b_y * y)
