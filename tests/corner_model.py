"""The image of a corner of a checkerboard in NumPy and double precision, and what the compiled fit makes of it."""

from ctypes import c_int64

import numpy as np
from scipy.special import erf

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel import PARAMETERS, RAMP_PX
from opencsp_calib.native import array_of, native_function, result_of

MODEL = np.array([0.2, -0.1, 0.15, 1.3, 1.3, 100.0, 60.0, 0.03, -0.02, 1.0, -0.8])  # light far steeper than any
CENTRED = MODEL + 40 * np.eye(2, PARAMETERS).sum(axis=0)  # in an image of 80x80 pixels
DIM = np.array([*CENTRED[:5], 30.0, 4.0, 0.03, -0.02, 0.01, -0.008])
UPRIGHT = np.array([40.0, 40.0, 0.0, np.pi / 2, *DIM[4:]])  # along the pixels
BENDS = np.array([0.002, -0.001])
FAR = np.array([100.0, 100.0, np.inf, np.inf])


def columns(p: Floats, x: Floats, y: Floats, bends: Floats = BENDS, window: Floats = FAR) -> Floats:
    """The derivatives by each parameter and the residual of black pixels at (x, y) from the corner on."""
    line = array_of(np.float64, 1)
    corner_image = native_function("corner_image", line, line, line, c_int64, line, line, result_of(np.float64, 2))
    made = np.empty((PARAMETERS + 1, len(x)))
    corner_image(p, bends, window, len(x), x, y, made)
    return made


def image(p: Floats, x: Floats, y: Floats, bends: Floats = BENDS) -> Floats:
    """The model's grey levels at (x, y) from the corner on."""
    edges, profiles, slopes, zs = [], [], [], []
    for angle, bend in zip(p[2:4], bends, strict=True):
        cosine, sine = np.cos(angle), np.sin(angle)
        z = (y * cosine - x * sine - bend / 2 * (x * cosine + y * sine) ** 2) / p[4]
        box = -(cosine**4 + sine**4) / 120 / 12 / p[4] ** 4  # fourth cumulant of a pixel across the edge, over 4!/2
        bell = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi)
        zs.append(z)
        profiles.append(erf(z / np.sqrt(2)) - box * (z**3 - 3 * z) * bell)
        slopes.append((2 + box * (z**4 - 6 * z**2 + 3)) * bell)
        edges.append((cosine, sine))
    lean = np.dot(*edges)
    pattern = profiles[0] * profiles[1] + lean * slopes[0] * slopes[1] * (1 + lean / 2 * zs[0] * zs[1])
    return p[5] + p[7] * x + p[8] * y + (p[6] + p[9] * x + p[10] * y) * pattern


def photograph_of(p: Floats, bends: Floats = BENDS) -> Floats:
    """The model's grey levels in an image of 80x80 pixels."""
    y, x = np.mgrid[:80, :80]
    return image(p, x - p[0], y - p[1], bends)


def seen(photograph: Floats, p: Floats, half: Floats, bends: Floats = BENDS) -> tuple[Floats, Floats, Floats, Floats]:
    """Of the pixels within a window: row, column, derivatives, residual, the last two times the root of the weight."""
    row, column = np.mgrid[:80, :80].reshape(2, -1)
    x, y = column - p[0], row - p[1]
    across = [y * np.cos(angle) - x * np.sin(angle) for angle in p[2:4]]
    along = np.abs(across[::-1] / np.sin(p[3] - p[2]))
    inside = (along < half[:2, None] + RAMP_PX / 2).all(axis=0)
    row, column, x, y = row[inside], column[inside], x[inside], y[inside]
    made = columns(p, x, y, bends, half)
    return row, column, made[:-1], made[-1] + made[5] * photograph[row, column]


def normal_equations(p: Floats, derivatives: Floats, residual: Floats) -> tuple[Floats, Floats]:
    """The normal matrix and its right-hand side; that gradients of light are small is known before looking."""
    variance = residual @ residual / (derivatives[5] ** 2).sum()
    usual = np.array([0.02, 0.02, 0.002, 0.002]) * p[6]
    normal, gradient = derivatives @ derivatives.T, derivatives @ residual
    normal[range(7, 11), range(7, 11)] += variance / usual**2
    gradient[7:] -= variance / usual**2 * p[7:]
    return normal, gradient
