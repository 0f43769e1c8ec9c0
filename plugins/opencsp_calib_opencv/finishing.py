"""The last steps to the least sum of squares, from where ``cv2.calibrateCamera`` stops, by OpenCV's own derivatives.

`cv2.calibrateCamera` takes pixels in single precision, iterates on products of derivatives, and so ends short of the
least sum of squares of the pixels as they are: by up to 5e-4 px with rational lens models; OpenCV 5 with 14
coefficients by some sigmas, in a bent valley. `cv2.projectPoints` gives projections and derivatives in double
precision; Gauss and Newton's steps by these, without products, lead to the end. Each view's pose is eliminated by an
orthogonal triangulation of its own rows, which keeps all digits, and the triangles that are left of all views make
another. Source: Björck, "Numerical methods for least squares problems", 1996.

How steps that lead too far are damped is in `opencsp_calib.valley`.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from opencsp_calib.arrays import Floats, Matrix, Params, Points
from opencsp_calib.detection import Detection
from opencsp_calib.unknowns import camera_basis
from opencsp_calib.valley import arrived, camera_step, lowest

__all__ = ["Solution", "finish"]

FARTHEST = 10.0  # sigmas; from farther away OpenCV has found something else
EXACT_PX = 1e-3  # no corner is located better: pixels without noise are judged as if they had this
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
    triangle : (Q + 1, Q + 1)
        Of all views, their poses eliminated.
    cost : float
        The sum of squares; NaN where a corner has no image.
    """

    solution: Solution
    triangles: Floats
    triangle: Matrix
    cost: float

    @property
    def promised(self) -> float:
        """How much lower the sum of squares is said to get."""
        return float((self.triangle[:-1, -1] ** 2).sum())


def finish(
    found: Solution, points: Points, detections: Sequence[Detection], pixel_aspect: float | None = None
) -> Solution:
    """Where the sum of squares is least, next to a solution.

    Only from within ten sigmas of it: a longer way is OpenCV's to find, or its answer would be nothing of its own.

    Parameters
    ----------
    found : Solution
        OpenCV's.
    points : (K, 3)
        The board's, in the unit of the translations.
    detections : sequence of Detection
        One per view.
    pixel_aspect : float, optional
        fy / fx, where it is held.
    """
    free, numbers = camera_basis(len(found.params), pixel_aspect), 2 * sum(map(len, detections))

    def at(solution: Solution) -> _Place | None:
        with np.errstate(all="ignore"):  # what OpenCV found may be wild
            try:
                return _at(solution, points, detections, free)
            except np.linalg.LinAlgError:
                return None

    start = at(found)
    if start is None:
        return found
    variance = max(start.cost / numbers, EXACT_PX**2)
    if not start.promised < FARTHEST**2 * variance:  # NaN is not
        return found
    end = lowest(start, lambda here, step: at(_moved(here, step, free)), variance)
    return _moved(end, camera_step(end.triangle, 0.0), free) if arrived(end) else end.solution


def _at(solution: Solution, points: Points, detections: Sequence[Detection], free: Matrix) -> _Place:
    views = zip(detections, solution.rotations, solution.translations, strict=True)
    triangles = np.array(
        [_triangle(_rows(solution.params, free, points[d.ids], d.pixels, *pose)) for d, *pose in views]
    )
    together = _triangle(triangles[:, POSE:, POSE:].reshape(-1, free.shape[1] + 1))
    return _Place(solution, triangles, together, float((triangles[:, :, -1] ** 2).sum()))


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
