"""The algebra of a step: the normal matrix, what is known before looking, Cholesky's factor."""

import math

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel.layout import PARAMETERS, RESIDUAL, STRIDE
from opencsp_calib.corner_kernel.machine_code import exact, fast

__all__ = ["accumulate", "expect", "factorise", "solve", "take_from_residuals"]

USUAL_GRADIENT_OF_A, USUAL_GRADIENT_OF_B = 0.02, 0.002  # of b, per px: a lamp's reflection is steep, light is not
SHARPEST_PX = 0.3  # that a pixel can see, being 0.29 wide itself; what was sharpened afterwards seems sharper


@fast
def accumulate(work: Floats, n: int, normal: Floats) -> None:
    """The normal matrix of the columns, its last row that of the residual; lower triangle."""
    for i in range(len(normal)):
        for j in range(i + 1):
            total = 0.0
            for k in range(n):
                total += work[i * STRIDE + k] * work[j * STRIDE + k]
            normal[i, j] = total


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
def take_from_residuals(work: Floats, n: int, step: Floats) -> None:
    """What the residuals are after a short step."""
    for i in range(len(step)):
        for k in range(n):
            work[RESIDUAL + k] -= step[i] * work[i * STRIDE + k]
