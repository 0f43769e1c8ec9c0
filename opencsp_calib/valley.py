"""The way to a least sum of squares along a valley that is all but flat, and bent.

Some unknowns of a camera can hardly be told apart: the numerator and the denominator of a rational lens model, for a
lens that needs neither. Then Gauss and Newton's steps lead too far, and next to the minimum back and forth about it,
for there the curvature of the residuals, which they leave out, counts as much as their derivatives.

Steps are damped (Levenberg and Marquardt), the camera's only; poses, and the board's corners, follow at once, since
damped with it they would bend the valley. The damping begins at the least squared singular value of the camera's
scaled derivatives, below which it does nothing. Then it follows the next step: one that leads back asks for more, one
that leads on for less, and while steps get short quickly it stays.
"""

from collections.abc import Callable
from typing import Protocol, TypeVar

import numpy as np

from opencsp_calib.arrays import Matrix, Params

__all__ = ["Place", "arrived", "camera_step", "lowest"]

STEPS = 80
ENOUGH = 1e-16  # of the sum of squares left to gain: some 1e-6 sigmas
NEAR = 1e-12  # variances left to gain: where nothing but rounding keeps a step from leading on
CLOSE = 1e-2  # likewise: from where on poses need no fit of their own
ROUNDING = 1e-9  # of the sum of squares: what its digits can tell for certain
QUICK = 0.1  # of what was left to gain: the damping that leaves less than that is kept
MORE, LESS = 5.0, 0.2  # times the damping
LEAST_DAMPING, MOST_DAMPING = 1e-20, 1.0


class Place(Protocol):
    """Values of all unknowns, and the sum of squares around them."""

    @property
    def cost(self) -> float:
        """The sum of squares; NaN where a corner has no image."""

    @property
    def promised(self) -> float:
        """How much lower it is said to get."""

    @property
    def triangle(self) -> Matrix:
        """(Q + 1, Q + 1) upper triangular: derivatives by the camera's unknowns, all others eliminated, and residuals.

        The residuals, in the last column, are those left to take away: observed minus predicted.
        """


AnyPlace = TypeVar("AnyPlace", bound=Place)


def lowest(here: AnyPlace, after: Callable[[AnyPlace, Params], AnyPlace | None], variance: float) -> AnyPlace:
    """The lowest place that steps lead to, never a higher one.

    Parameters
    ----------
    here : Place
        Within some sigmas of the minimum.
    after : callable
        Where a step of the camera's unknowns (Q,) leads, all others following; None where nothing can be said of it.
    variance : float
        Of one residual.
    """
    damping = 0.0
    for _ in range(STEPS):
        if arrived(here):
            break
        step = camera_step(here.triangle, damping)
        there = after(here, step)
        if there and not _lower(there, here, step) and here.promised > CLOSE * variance:
            there = after(there, np.zeros(len(step)))
        rounding = here.promised < NEAR * variance and not (there and there.promised < here.promised)
        if rounding or damping > MOST_DAMPING:
            break
        if there and _lower(there, here, step):
            here, damping = there, _next_damping(damping, here, there, step)
        else:
            damping = max(MORE * damping, _least_damping(here.triangle))
    return here


def arrived(here: Place) -> bool:
    """Whether one more step that is not damped leads to the minimum, as far as numbers can tell."""
    return here.promised <= ENOUGH * here.cost


def camera_step(triangle: Matrix, damping: float) -> Params:
    """(Q,) Gauss and Newton's step by a `Place.triangle`, damped; NaN where there is none."""
    size, scale = len(triangle) - 1, _scale(triangle)
    scaled = triangle * np.append(scale, 1.0)
    if damping:
        scaled = np.linalg.qr(np.vstack([scaled, np.sqrt(damping) * np.eye(size, size + 1)]), mode="r")
    try:
        return np.asarray(scale * np.linalg.solve(scaled[:size, :size], scaled[:size, size]))
    except np.linalg.LinAlgError:
        return np.full(size, np.nan)


def _next_damping(damping: float, here: Place, there: Place, step: Params) -> float:
    if there.promised < QUICK * here.promised:
        return damping
    if _slope(there, step) < 0.0:
        return max(MORE * damping, _least_damping(there.triangle))
    return LESS * damping if damping > LESS * _least_damping(there.triangle) else 0.0


def _lower(there: Place, here: Place, step: Params) -> bool:
    """Whether the sum of squares is lower; by the slopes at both ends where its own digits are too few to tell."""
    if there.cost < here.cost * (1.0 - ROUNDING):
        return True
    return there.cost <= here.cost * (1.0 + ROUNDING) and _slope(here, step) + _slope(there, step) > 0.0


def _slope(here: Place, step: Params) -> float:
    """Half of by how much the sum of squares falls along a step, were its slope the same all the way."""
    return float((here.triangle[:-1, :-1] @ step) @ here.triangle[:-1, -1])


def _scale(triangle: Matrix) -> Params:
    """(Q,) what brings the camera's unknowns to one size: coefficients and focal lengths differ by orders."""
    return np.asarray(1.0 / np.linalg.norm(triangle[:-1, :-1], axis=0))


def _least_damping(triangle: Matrix) -> float:
    least = np.linalg.svd(triangle[:-1, :-1] * _scale(triangle), compute_uv=False)[-1]
    return max(float(least**2), LEAST_DAMPING)
