"""The algebra of a step: the normal matrix, what is known before looking, Cholesky's factor."""

import math

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel.layout import PARAMETERS, RESIDUAL
from opencsp_calib.corner_kernel.machine_code import exact, fast, unsigned

__all__ = ["accumulate", "expect", "factorise", "solve", "take_from_residuals"]

USUAL_GRADIENT_OF_A, USUAL_GRADIENT_OF_B = 0.02, 0.002  # of b, per px: a lamp's reflection is steep, light is not
SHARPEST_PX = 0.3  # that a pixel can see, being 0.29 wide itself; what was sharpened afterwards seems sharper


@fast
def accumulate(table: Floats, n: int, normal: Floats) -> None:
    """The normal matrix of the columns, its last row that of the residual; lower triangle.

    Two rows by two columns at once: each number that is read is used twice.
    """
    for i in range(0, len(normal), 2):
        for j in range(0, i + 1, 2):
            a, b, c, d = table[i], table[i + 1], table[j], table[j + 1]
            ac = ad = bc = bd = 0.0
            for k in range(unsigned(n)):
                ac += a[k] * c[k]
                ad += a[k] * d[k]
                bc += b[k] * c[k]
                bd += b[k] * d[k]
            normal[i, j], normal[i, j + 1], normal[i + 1, j], normal[i + 1, j + 1] = ac, ad, bc, bd


@exact
def expect(p: Floats, variance: float, normal: Floats) -> None:
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


@exact
def factorise(normal: Floats, factor: Floats) -> bool:
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


@exact
def solve(factor: Floats, vector: Floats) -> None:
    """Replace a right-hand side by its solution."""
    for i in range(len(factor)):
        for k in range(i):
            vector[i] -= factor[i, k] * vector[k]
        vector[i] /= factor[i, i]
    for i in range(len(factor) - 1, -1, -1):
        for k in range(i + 1, len(factor)):
            vector[i] -= factor[k, i] * vector[k]
        vector[i] /= factor[i, i]


@fast
def take_from_residuals(table: Floats, n: int, step: Floats) -> None:
    """What the residuals are after a short step."""
    residuals = table[RESIDUAL]
    for i in range(len(step)):
        derivatives, change = table[i], step[i]
        for k in range(unsigned(n)):
            residuals[k] -= change * derivatives[k]
