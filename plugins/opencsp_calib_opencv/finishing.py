"""The last steps to the least sum of squares, from where ``cv2.calibrateCamera`` stops, by OpenCV's own derivatives.

`cv2.calibrateCamera` takes pixels in single precision, iterates on products of derivatives, and so ends short of the
least sum of squares of the pixels as they are: by up to 5e-4 px with rational lens models; OpenCV 5 with 14
coefficients by some sigmas, in a bent valley. `cv2.projectPoints` gives projections and derivatives in double
precision; Gauss and Newton's steps by these, without products, lead to the end. Each view's pose is eliminated by an
orthogonal triangulation of its own rows, which keeps all digits, and the triangles that are left of all views make
another. Source: Björck, "Numerical methods for least squares problems", 1996.

Where such a step leads too far, each pose is fitted to the moved camera; if that is not enough the camera's step is
damped (Levenberg and Marquardt). The poses follow at once: damped with it they would bend the valley.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from opencsp_calib.arrays import Floats, Matrix, Params
from opencsp_calib.unknowns import camera_basis

__all__ = ["Solution", "finish"]

STEPS = 80  # with noise and a rational lens each step leaves up to half of what is missing
ENOUGH = 1e-16  # of the sum of squares left to gain: some 1e-6 sigmas
NEAR = 1e-12  # variances left to gain: where nothing but rounding keeps a step from leading on
CLOSE = 1e-2  # likewise: where a step that leads too far is halved
HALVINGS = 3
ROUNDING = 1e-9  # of the sum of squares: near the minimum it may rise by that
FARTHEST = 10.0  # sigmas; from farther away OpenCV has found something else
EXACT_PX = 1e-3  # no corner is located better: pixels without noise are judged as if they had this
LEAST_DAMPING, MOST_DAMPING = 1e-12, 1.0
POSE = 6  # of a view: OpenCV's first columns


class Solution(NamedTuple):
    """What OpenCV solves for, in its own units.

    Parameters
    ----------
    params : (P,)
        Of the lens model, fx, fy, cx, cy first.
    rotations : (V, 3) rad
    translations : (V, 3)
        In the unit of the board's points.
    """

    params: Params
    rotations: Floats
    translations: Floats


class _Place(NamedTuple):
    """A solution, and the sum of squares around it.

    Parameters
    ----------
    solution : Solution
    triangles : (V, 7 + Q, 7 + Q)
        Of each view's rows, its pose first.
    whole : (Q + 1, Q + 1)
        Of all views, their poses eliminated.
    cost : float
        The sum of squares; NaN where a corner has no image.
    """

    solution: Solution
    triangles: Floats
    whole: Matrix
    cost: float

    @property
    def promised(self) -> float:
        """How much lower the sum of squares is said to get."""
        return float((self.whole[:-1, -1] ** 2).sum())


def finish(
    found: Solution, points: Sequence[Floats], pixels: Sequence[Floats], pixel_aspect: float | None = None
) -> Solution:
    """Where the sum of squares is least, next to a solution.

    Only from within ten sigmas of it: a longer way is OpenCV's to find, or its answer would be nothing of its own.

    Parameters
    ----------
    found : Solution
        OpenCV's.
    points : sequence of (n, 3)
        The board's, as each view sees them.
    pixels : sequence of (n, 2)
    pixel_aspect : float, optional
        fy / fx, where it is held.
    """
    free, numbers = camera_basis(len(found.params), pixel_aspect), 2 * sum(len(view) for view in pixels)

    def at(solution: Solution) -> _Place:
        with np.errstate(all="ignore"):  # what OpenCV found may be wild
            return _at(solution, points, pixels, free)

    try:
        here = at(found)
    except np.linalg.LinAlgError:
        return found
    variance, damping = max(here.cost / numbers, EXACT_PX**2), 0.0
    if not here.promised < FARTHEST**2 * variance:  # NaN is not
        return found
    for _ in range(STEPS):
        if here.promised <= ENOUGH * here.cost:
            return _stepped(here, free, 0.0)
        further = _further(here, at, free, damping, close=here.promised < CLOSE * variance)
        if further is not None:
            here, damping = further, 0.1 * damping if damping > LEAST_DAMPING else 0.0
        elif here.promised < NEAR * variance or damping > MOST_DAMPING:
            break
        else:
            damping = max(10.0 * damping, LEAST_DAMPING)
    return here.solution


def _further(
    here: _Place, at: Callable[[Solution], _Place], free: Matrix, damping: float, *, close: bool
) -> _Place | None:
    """Where a step leads, or half of it, or all of it and then one of the poses alone; None where neither is better."""
    try:
        there = at(_stepped(here, free, damping))
        for _ in range(HALVINGS if close else 0):
            if _better(there, here):
                break
            there = at(Solution(*(0.5 * (one + two) for one, two in zip(here.solution, there.solution, strict=True))))
        if not _better(there, here) and not close:
            there = at(_moved(there, np.zeros(free.shape[1]), free))
    except np.linalg.LinAlgError:
        return None
    return there if _better(there, here) else None


def _better(there: _Place, here: _Place) -> bool:
    """Whether the sum of squares is lower, or there is less to gain and it is the same but for rounding."""
    lower = there.cost < here.cost * (1.0 - ROUNDING)
    return lower or (there.promised < here.promised and there.cost <= here.cost * (1.0 + ROUNDING))


def _at(solution: Solution, points: Sequence[Floats], pixels: Sequence[Floats], free: Matrix) -> _Place:
    views = zip(points, pixels, solution.rotations, solution.translations, strict=True)
    triangles = np.array([_triangle(_rows(solution.params, free, *view)) for view in views])
    whole = _triangle(triangles[:, POSE:, POSE:].reshape(-1, free.shape[1] + 1))
    return _Place(solution, triangles, whole, float((triangles[:, :, -1] ** 2).sum()))


def _stepped(here: _Place, free: Matrix, damping: float) -> Solution:
    """Gauss and Newton's step, the camera's part of it damped."""
    size = free.shape[1]
    scale = 1.0 / np.linalg.norm(here.whole[:, :size], axis=0)  # coefficients and focal lengths differ by orders
    scaled = here.whole * np.append(scale, 1.0)
    if damping:
        scaled = _triangle(np.vstack([scaled, np.sqrt(damping) * np.eye(size, size + 1)]))
    return _moved(here, scale * np.linalg.solve(scaled[:size, :size], scaled[:size, size]), free)


def _moved(here: _Place, camera: Params, free: Matrix) -> Solution:
    """After a step of the camera (Q,), the poses following."""
    triangles, (params, rotations, translations) = here.triangles, here.solution
    of_poses = triangles[:, :POSE, -1] - triangles[:, :POSE, POSE:-1] @ camera
    poses = np.linalg.solve(triangles[:, :POSE, :POSE], of_poses[:, :, None])[:, :, 0]
    return Solution(params + free @ camera, rotations + poses[:, :3], translations + poses[:, 3:])


def _triangle(rows: Matrix) -> Matrix:
    """(n, n) of rows (m, n), m >= n, what is left of them after a rotation: upper triangular."""
    return np.asarray(np.linalg.qr(rows, mode="r"), dtype=np.float64)


def _rows(
    params: Params, free: Matrix, points: Floats, pixels: Floats, rotation: Floats, translation: Floats
) -> Matrix:
    """(2 n, 6 + Q + 1) derivatives of a view's projections by its pose and by the camera, and what is left of pixels.

    Filled up with zeros to no fewer rows than columns.
    """
    import cv2

    matrix = np.array([[params[0], 0.0, params[2]], [0.0, params[1], params[3]], [0.0, 0.0, 1.0]])
    distortion = np.zeros(max(len(params) - 4, 4))
    distortion[: len(params) - 4] = params[4:]
    projected, rows = cv2.projectPoints(points, rotation, translation, matrix, distortion)
    left = (pixels - projected[:, 0]).reshape(-1, 1)
    rows = np.hstack([rows[:, :POSE], rows[:, POSE : POSE + len(params)] @ free, left])
    lacking = max(0, rows.shape[1] - len(rows))
    return np.pad(rows, ((0, lacking), (0, 0)))
