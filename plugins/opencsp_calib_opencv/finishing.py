"""The last steps to the least sum of squares, from where ``cv2.calibrateCamera`` stops, by OpenCV's own derivatives.

`cv2.calibrateCamera` takes pixels in single precision, iterates on products of derivatives, and so ends short of the
least sum of squares of the pixels as they are: by up to 5e-4 px with rational lens models. `cv2.projectPoints` gives
projections and derivatives in double precision; Gauss and Newton's steps by these, without products, lead to the end.
Each view's pose is eliminated by an orthogonal triangulation of its own rows, which keeps all digits, and the
triangles that are left of all views make another. Source: Björck, "Numerical methods for least squares problems", 1996.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from opencsp_calib.arrays import Floats, Matrix, Params

__all__ = ["Solution", "finish"]

STEPS = 30  # with noise and a rational lens each step leaves up to half of what is missing
ENOUGH = 1e-16  # of the sum of squares left to gain: some 1e-6 sigmas
ROUNDING = 1e-9  # of the sum of squares: near the minimum it may rise by that
EXACT_PX = 1e-3  # no corner is located better: pixels without noise are judged as if they had this
HALVINGS = 3  # of a step that leads too far
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


def finish(
    found: Solution, points: Sequence[Floats], pixels: Sequence[Floats], pixel_aspect: float | None = None
) -> Solution:
    """Where the sum of squares is least, next to a solution.

    Only from within one sigma of it: a longer way is OpenCV's to find. Each step has to lower the sum of squares and to
    leave less to gain; one that does not is halved.

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
    free, numbers = _free(len(found.params), pixel_aspect), 2 * sum(len(view) for view in pixels)
    best, least, limit, halvings = found, np.inf, np.inf, 0
    for _ in range(STEPS):
        try:
            with np.errstate(all="ignore"):  # what OpenCV found may be wild
                further, promised, cost = _step(found, points, pixels, free)
        except np.linalg.LinAlgError:
            promised = cost = np.nan
        near = promised < max(cost / numbers, EXACT_PX**2)
        if near and promised < least and cost <= limit:  # NaN is not
            if promised <= ENOUGH * cost:
                return further
            best, least, limit, halvings, found = found, promised, cost * (1.0 + ROUNDING), 0, further
        elif found is best or halvings == HALVINGS:
            break
        else:
            found, halvings = Solution(*(0.5 * (one + two) for one, two in zip(best, found, strict=True))), halvings + 1
    return best


def _free(count: int, pixel_aspect: float | None) -> Matrix:
    """(P, Q) what the parameters may do."""
    free = np.eye(count)
    if pixel_aspect is None:
        return free
    free[1, 0] = pixel_aspect
    return np.delete(free, 1, axis=1)


def _step(
    found: Solution, points: Sequence[Floats], pixels: Sequence[Floats], free: Matrix
) -> tuple[Solution, float, float]:
    """Where Gauss and Newton's step leads, how much it promises to lower the sum of squares, and that sum."""
    views = zip(points, pixels, found.rotations, found.translations, strict=True)
    triangles = np.array([_triangle(_rows(found.params, free, *view)) for view in views])
    camera = free.shape[1]
    whole = _triangle(triangles[:, POSE:, POSE:].reshape(-1, camera + 1))
    scale = 1.0 / np.linalg.norm(whole[:, :camera], axis=0)  # coefficients and focal lengths differ by orders
    moved = scale * np.linalg.solve(whole[:camera, :camera] * scale, whole[:camera, camera])
    of_poses = triangles[:, :POSE, -1] - triangles[:, :POSE, POSE:-1] @ moved
    poses = np.linalg.solve(triangles[:, :POSE, :POSE], of_poses[:, :, None])[:, :, 0]
    params, rotations, translations = found
    further = Solution(params + free @ moved, rotations + poses[:, :3], translations + poses[:, 3:])
    return further, float((whole[:camera, camera] ** 2).sum()), float((triangles[:, :, -1] ** 2).sum())


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
