"""The compiled fit of the image of a checkerboard's corner. Importing this imports Numba: see `opencsp_calib.compiled`.

Around a corner the image is taken as ``a + b u v``. u and v are the profiles, from -1 to 1, of two edges that
cross in the corner: a step seen through a Gaussian of deviation s. What the product lacks is added to first order: for
the pixel's own area, which is no Gaussian, by the Gram-Charlier series with the fourth cumulant of a box; for edges
that are not perpendicular, by the tetrachoric series of the bivariate normal distribution. Edges may be bent, by a
curvature that is given. a and b have gradients: light that changes across the board scales both, a reflection is added.

Whatever else is wrong with this model is alike on opposite sides of the corner (another psf, neighbouring squares, a
tone curve) and so does not move it, as long as the window is symmetric about the corner: therefore the window follows
the corner in every step, and ends in a soft ramp instead of at whole pixels.

The form of the code is ruled by the compiler. One flat buffer with constant offsets, because LLVM vectorises a loop
only where it can prove that what is written is not read again, and gives up beyond a hundred pairs of columns. No
slices, because each costs a tenth of a second of compilation. Lengths are asked for, though constant, lest loops be
unrolled. All in one file, because Numba's cache looks for changes in the file of the outermost function only.
"""

import math
from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numpy as np
from numba import njit
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats

__all__ = ["CONVERGED", "DIAGNOSTICS", "FAILED", "OUTSIDE", "PARAMETERS", "RAMP_PX", "WORK_SIZE", "fit_corners"]

PARAMETERS = 11  # x, y, angle of edge 1, of edge 2, s, a, b, gradient of a in x and y, gradient of b
DIAGNOSTICS = 23
USUAL_GRADIENT_OF_A, USUAL_GRADIENT_OF_B = 0.02, 0.002  # of b, per px: a lamp's reflection is steep, light is not
MOST_SWING = 0.5  # of the last step: a step back that is longer has overshot, and from then on steps are halved
SHARPEST_PX = 0.3  # that a pixel can see, being 0.29 wide itself; what was sharpened afterwards seems sharper
RAMP_PX = 1.5  # over which a pixel's weight falls to nothing at the border of the window

# Columns of the buffer: derivatives by each parameter, residual, x, y, grey level. The derivative by a is the root
# of the weight. The largest window, a parallelogram with sides of 2 * 14 + 1.5 px, holds fewer than 1088 pixels.
STRIDE = 1088
RESIDUAL, X, Y, LEVEL, ROOT = 11 * STRIDE, 12 * STRIDE, 13 * STRIDE, 14 * STRIDE, 5 * STRIDE
PLACED, SIDE = 15 * STRIDE, 64  # then residuals as a picture, the corner in its middle
WORK_SIZE = PLACED + SIDE * SIDE

CONVERGED, OUTSIDE, FAILED = 0, 1, 2

P = ParamSpec("P")
T = TypeVar("T")


def _exact(function: Callable[P, T]) -> Callable[P, T]:
    # NumPy's way to divide, because looking for a zero each time keeps loops from being vectorised
    made: Callable[P, T] = njit(nogil=True, error_model="numpy")(function)
    return made


def _fast(function: Callable[P, T]) -> Callable[P, T]:
    # sums may be taken in any order; NaN and infinity keep their meaning
    options = {"reassoc", "contract", "nsz", "arcp"}
    made: Callable[P, T] = njit(nogil=True, error_model="numpy", fastmath=options)(function)
    return made


@_fast
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


@_exact
def _overlap(offset: float, slope: float, half: float, low: float, high: float) -> tuple[float, float]:
    """The part of an interval of x in which ``|slope x - offset| <= half``."""
    if abs(slope) < 1e-9:
        return (low, high) if abs(offset) <= half else (1.0, 0.0)
    middle, reach = offset / slope, half / abs(slope)
    return max(low, middle - reach), min(high, middle + reach)


@_exact
def _gather(image: NDArray[np.uint16], p: Floats, window: Floats, work: Floats) -> int:
    """Copy the window's pixels into the buffer, x and y from the corner on; how many, or -1 if some are outside."""
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
            work[X + n] = column - p[0]
            work[Y + n] = y
            work[LEVEL + n] = image[row, column]
            n += 1
    return n


@_fast
def _differentiate(p: Floats, bend1: float, bend2: float, window: Floats, n: int, work: Floats) -> float:
    """Fill the columns: residual and derivatives, each times the root of the pixel's weight; the sum of weights."""
    s = p[4]
    x1, y1, x2, y2 = math.cos(p[2]), math.sin(p[2]), math.cos(p[3]), math.sin(p[3])
    cosine, sine = x1 * x2 + y1 * y2, x1 * y2 - y1 * x2
    box = -1.0 / (
        1440.0 * max(s, 0.4) ** 4
    )  # the fourth cumulant of a box of width w is -w^4/120; over 12, see _profile
    kurtosis1, kurtosis2 = box * (x1**4 + y1**4), box * (x2**4 + y2**4)
    limit1, limit2, clear1, clear2 = window[0] / RAMP_PX + 0.5, window[1] / RAMP_PX + 0.5, window[2], window[3]
    total = 0.0
    for k in range(n):
        x, y = work[X + k], work[Y + k]
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
        pattern = u * v + skew * more
        height = root * (p[6] + p[9] * x + p[10] * y)
        slope1 = height / s * (du * v + skew * (0.5 * cosine * z2 - z1 * more))
        slope2 = height / s * (u * dv + skew * (0.5 * cosine * z1 - z2 * more))
        shear = height * sine * du * dv * (1.0 + cosine * z1 * z2)
        work[k] = slope1 * y1 + slope2 * y2
        work[STRIDE + k] = -slope1 * x1 - slope2 * x2
        work[2 * STRIDE + k] = shear - slope1 * turn1
        work[3 * STRIDE + k] = -shear - slope2 * turn2
        work[4 * STRIDE + k] = -(slope1 * z1 + slope2 * z2)
        work[5 * STRIDE + k] = root
        work[6 * STRIDE + k] = root * pattern
    for k in range(n):  # a loop of its own, for the compiler's hundred pairs
        x, y, root, pattern = work[X + k], work[Y + k], work[5 * STRIDE + k], work[6 * STRIDE + k]
        work[7 * STRIDE + k] = root * x
        work[8 * STRIDE + k] = root * y
        work[9 * STRIDE + k] = pattern * x
        work[10 * STRIDE + k] = pattern * y
        plain = root * (p[5] + p[7] * x + p[8] * y) + pattern * (p[6] + p[9] * x + p[10] * y)
        work[RESIDUAL + k] = root * work[LEVEL + k] - plain
    return total


@_fast
def _accumulate(work: Floats, n: int, normal: Floats) -> None:
    """The normal matrix of the columns, its last row that of the residual; lower triangle."""
    for i in range(len(normal)):
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                total += work[i * STRIDE + k] * work[j * STRIDE + k]
            normal[i, j] = total


@_exact
def _expect(p: Floats, variance: float, normal: Floats) -> None:
    """Add what is known before looking: that gradients are small, relative to the amplitude, and what can be sharp.

    In small windows and much blur gradients can hardly be told from a shift of the corner.
    """
    for k in range(7, PARAMETERS):
        usual = (USUAL_GRADIENT_OF_A if k < 9 else USUAL_GRADIENT_OF_B) * p[6]
        weight = variance / (usual * usual + 1e-9)
        normal[k, k] += weight
        normal[PARAMETERS, k] -= weight * p[k]
    if p[4] <= SHARPEST_PX and normal[PARAMETERS, 4] < 0.0:
        normal[4, 4] *= 1e6  # it will not get sharper, and the others' step must not count on it


@_exact
def _factorise(normal: Floats, factor: Floats) -> bool:
    """Cholesky's factor of the normal matrix; False if there is none."""
    for i in range(len(factor)):
        for j in range(i + 1):
            value = normal[i, j]
            for k in range(j):
                value -= factor[i, k] * factor[j, k]
            if i > j:
                factor[i, j] = value / factor[j, j]
            elif value > 1e-12 * normal[i, i]:
                factor[i, i] = math.sqrt(value)
            else:
                return False
    return True


@_exact
def _solve(factor: Floats, vector: Floats) -> None:
    """Replace a right-hand side by its solution."""
    for i in range(len(factor)):
        for k in range(i):
            vector[i] -= factor[i, k] * vector[k]
        vector[i] /= factor[i, i]
    for i in range(len(factor) - 1, -1, -1):
        for k in range(i + 1, len(factor)):
            vector[i] -= factor[k, i] * vector[k]
        vector[i] /= factor[i, i]


@_exact
def _trusted_part(p: Floats, step: Floats) -> float:
    """The fraction of a step within which the model is nearly linear."""
    fraction: float = min(1.0, 1.5 / (math.hypot(step[0], step[1]) + 1e-9))
    fraction = min(fraction, 0.3 / (max(abs(step[2]), abs(step[3])) + 1e-9))
    slowest: float = 0.6 * p[4] / (abs(step[4]) + 1e-9)
    return min(fraction, slowest)


@_exact
def _fit(
    image: NDArray[np.uint16],
    p: Floats,
    bends: Floats,
    window: Floats,
    tolerance: float,
    most_steps: int,
    work: Floats,
    normal: Floats,
    factor: Floats,
    step: Floats,
) -> tuple[int, int]:
    """Gauss-Newton's method, a step halved until the misfit falls; status and number of pixels."""
    n, best, calm = 0, math.inf, 1.0
    step[:] = 0.0
    for _ in range(most_steps):
        n = _gather(image, p, window, work)
        if n < 3 * PARAMETERS:
            return OUTSIDE, n
        weight = _differentiate(p, bends[0], bends[1], window, n, work)
        _accumulate(work, n, normal)
        misfit = normal[PARAMETERS, PARAMETERS] / weight
        if misfit > 1.1 * best:  # not just more: as the window moves with the corner, the root is not quite the minimum
            for k in range(len(step)):
                step[k] *= 0.5
                p[k] -= step[k]
            continue
        best = min(best, misfit)
        _expect(p, misfit, normal)
        if not _factorise(normal, factor):
            return FAILED, n
        last_x, last_y = step[0], step[1]
        for k in range(len(step)):
            step[k] = normal[PARAMETERS, k]
        _solve(factor, step)
        close = math.hypot(step[0], step[1]) < tolerance and abs(step[4]) < 10 * tolerance
        if step[0] * last_x + step[1] * last_y < -MOST_SWING * (last_x * last_x + last_y * last_y):
            calm *= 0.5
        fraction = calm * _trusted_part(p, step)
        for k in range(len(step)):
            step[k] *= fraction
        step[4] = max(step[4], SHARPEST_PX - p[4])
        for k in range(len(step)):
            p[k] += step[k]
        if close:
            return CONVERGED, n
    return FAILED, n


@_fast
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


@_exact
def _examine_place(p: Floats, n: int, work: Floats, factor: Floats, pulls: Floats, row: Floats, found: Floats) -> None:
    """The inverse normal matrix of x and y, and their response to bends."""
    _pull(p, n, work, pulls)
    for coordinate in range(2):
        for k in range(len(row)):
            row[k] = 1.0 if k == coordinate else 0.0
        _solve(factor, row)
        found[3 + coordinate], found[4 + coordinate] = row[0], row[1]
        for edge in range(2):
            for k in range(len(row)):
                found[6 + 2 * coordinate + edge] += row[k] * pulls[k, edge]


@_exact
def _examine_quarters(p: Floats, n: int, white: float, work: Floats, found: Floats) -> None:
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


@_exact
def _examine_opposites(p: Floats, n: int, work: Floats, found: Floats) -> None:
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


def fit_corners(
    image: NDArray[np.uint16],
    white: float,
    parameters: Floats,
    bends: Floats,
    windows: Floats,
    tolerance: float,
    most_steps: int,
    examine: bool,
    work: Floats,
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
    work : (WORK_SIZE,)
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
        result[0], n = _fit(image, p, bends[c], windows[c], tolerance, most_steps, work, normal, factor, step)
        if examine and result[0] == CONVERGED:
            _examine_place(p, n, work, factor, pulls, step, result)
            _examine_quarters(p, n, white, work, result)
            _examine_opposites(p, n, work, result)
