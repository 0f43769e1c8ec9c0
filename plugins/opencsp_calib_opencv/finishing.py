"""The last steps to the least sum of squares, from where ``cv2.calibrateCamera`` stops, by OpenCV's own derivatives.

`cv2.calibrateCamera` takes pixels in single precision, iterates on products of derivatives, and so ends short of the
least sum of squares of the pixels as they are: by up to 5e-4 px with rational lens models; OpenCV 5 with 14
coefficients by some sigmas, in a bent valley. `cv2.projectPoints` gives projections and derivatives in double
precision; Gauss and Newton's steps by these, without products, lead to the end. Each view's pose is eliminated by an
orthogonal triangulation of its own rows, which keeps all digits, and the triangles that are left of all views make
another. Source: Björck, "Numerical methods for least squares problems", 1996.

Where such a step leads too far, each pose is fitted to the moved camera; if that is not enough the camera's step is
damped (Levenberg and Marquardt). The poses follow at once: damped with it they would bend the valley. The damping is
for what can hardly be told apart, such as a rational lens model's numerator and denominator for a lens that needs
neither: it begins at the least squared singular value, below which it does nothing, and a step that has to be taken
back in part asks for more of it, for there the residuals' own curvature counts.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from opencsp_calib.arrays import Floats, Matrix, Params
from opencsp_calib.unknowns import camera_basis

__all__ = ["Solution", "finish"]

STEPS = 80
ENOUGH = 1e-16  # of the sum of squares left to gain: some 1e-6 sigmas
NEAR = 1e-12  # variances left to gain: where nothing but rounding keeps a step from leading on
CLOSE = 1e-2  # likewise: from where on poses need no fit of their own
ROUNDING = 1e-9  # of the sum of squares: near the minimum it may rise by that
FARTHEST = 10.0  # sigmas; from farther away OpenCV has found something else
EXACT_PX = 1e-3  # no corner is located better: pixels without noise are judged as if they had this
QUICK = 0.1  # of what was left to gain: the damping that leaves less than that is kept
MORE, LESS = 5.0, 0.2  # times the damping
LEAST_DAMPING, MOST_DAMPING = 1e-20, 1.0
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

    @property
    def scale(self) -> Params:
        """(Q,) what brings the camera's unknowns to one size: coefficients and focal lengths differ by orders."""
        return np.asarray(1.0 / np.linalg.norm(self.whole[:-1, :-1], axis=0))

    @property
    def least_damping(self) -> float:
        """What first does anything to a step, for those unknowns that can hardly be told apart."""
        least = np.linalg.svd(self.whole[:-1, :-1] * self.scale, compute_uv=False)[-1]
        return max(float(least**2), LEAST_DAMPING)


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

    def at(solution: Solution) -> _Place | None:
        with np.errstate(all="ignore"):  # what OpenCV found may be wild
            try:
                return _at(solution, points, pixels, free)
            except np.linalg.LinAlgError:
                return None

    here, damping = at(found), 0.0
    if here is None:
        return found
    variance = max(here.cost / numbers, EXACT_PX**2)
    if not here.promised < FARTHEST**2 * variance:  # NaN is not
        return found
    for _ in range(STEPS):
        if here.promised <= ENOUGH * here.cost:
            return _moved(here, _camera_step(here, 0.0), free)
        step = _camera_step(here, damping)
        there = at(_moved(here, step, free))
        if there and not _better(there, here) and here.promised > CLOSE * variance:
            there = at(_moved(there, np.zeros(len(step)), free))
        if there and _better(there, here):
            here, damping = there, _next_damping(damping, here, there, step)
        elif here.promised < NEAR * variance or damping > MOST_DAMPING:
            break
        else:
            damping = max(MORE * damping, here.least_damping)
    return here.solution


def _next_damping(damping: float, here: _Place, there: _Place, step: Params) -> float:
    """More where the next step leads back, less where it leads on; as it is where steps get short quickly."""
    if there.promised < QUICK * here.promised:
        return damping
    if (there.whole[:-1, :-1] @ step) @ there.whole[:-1, -1] < 0.0:
        return max(MORE * damping, there.least_damping)
    return LESS * damping if damping > LESS * there.least_damping else 0.0


def _better(there: _Place, here: _Place) -> bool:
    """Whether the sum of squares is lower, or there is less to gain and it is the same but for rounding."""
    lower = there.cost < here.cost * (1.0 - ROUNDING)
    return lower or (there.promised < here.promised and there.cost <= here.cost * (1.0 + ROUNDING))


def _at(solution: Solution, points: Sequence[Floats], pixels: Sequence[Floats], free: Matrix) -> _Place:
    views = zip(points, pixels, solution.rotations, solution.translations, strict=True)
    triangles = np.array([_triangle(_rows(solution.params, free, *view)) for view in views])
    whole = _triangle(triangles[:, POSE:, POSE:].reshape(-1, free.shape[1] + 1))
    return _Place(solution, triangles, whole, float((triangles[:, :, -1] ** 2).sum()))


def _camera_step(here: _Place, damping: float) -> Params:
    """(Q,) Gauss and Newton's step of the camera, damped; NaN where there is none."""
    size = here.whole.shape[1] - 1
    scaled = here.whole * np.append(here.scale, 1.0)
    if damping:
        scaled = _triangle(np.vstack([scaled, np.sqrt(damping) * np.eye(size, size + 1)]))
    try:
        return np.asarray(here.scale * np.linalg.solve(scaled[:size, :size], scaled[:size, size]))
    except np.linalg.LinAlgError:
        return np.full(size, np.nan)


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
