"""Where the board is in one photograph, by a camera that is known already: nothing but the pose is fitted.

Levenberg-Marquardt on six unknowns, from the linear solution and from its mirror image: seen from afar, a flat board
tilted towards the camera looks almost like one tilted away from it, each is a minimum of its own, and noise decides
next to which of them the linear solution lies (the two-fold ambiguity of planar poses; Schweighofer and Pinz, "Robust
pose estimation from a planar target", PAMI 2006). Where the board is so small or far that its perspective hardly shows
in the noise, the linear solution may be wrong in any way, and a few more starts are tried.
"""

from collections.abc import Sequence

import numpy as np

from opencsp_calib.arrays import Floats, Mask, Matrix, Pixels, Points, Vector
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.comparison import frame_jacobian
from opencsp_calib.detection import Detection, Observations, View
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.initial import initial_poses
from opencsp_calib.pose import Pose
from opencsp_calib.rotations import rotation_matrices

__all__ = ["MIN_CORNERS", "fit_pose", "on_one_line", "pose_residuals"]

MIN_CORNERS = 4
"""Of one view, and not on one line: fewer do not tell where a board is."""
ON_A_LINE = 1e-6  # width of a set of corners, in parts of its length
CLEAR = 30.0  # times the residuals: perspective that shows by more cannot be mistaken
TILT = 0.7  # rad, of the starts tried where it is not clear: between head-on and grazing
MAX_STEPS = 100
MAX_DAMPING = 1e8
SMALL_GAIN = 1e-12  # of the cost: where a step promises less, it has converged, to 1e-6 of what noise leaves open
EXACT_PX = 1e-10  # residuals below this are rounding


def fit_pose(camera: Camera, board: Board, detection: Detection) -> Pose:
    """The pose of a board that explains its corners best, every corner weighing the same.

    Parameters
    ----------
    camera : Camera
        Held as it is.
    board : Board
        Held as it is; about flat.
    detection : Detection
        At least four corners, not all on one line.

    Returns
    -------
    Pose
        Board to camera.

    Raises
    ------
    InputError
        If there are too few corners, or they are on one line.
    CalibrationFailedError
        If no pose was found that puts the corners before the camera.
    """
    points = board.points[detection.ids]
    if len(points) < MIN_CORNERS or on_one_line(points):
        raise InputError(f"{len(points)} corners, or all on one line, do not tell where the board is")
    middle = points.mean(axis=0)
    view = Observations(board, camera.image_size, (View("", detection, "used"),))
    (start,) = initial_poses(camera, view)
    at = start.transform(middle[None])[0]

    def refined(starts: Sequence[Matrix]) -> tuple[float, Matrix, Vector]:
        tried = (_refined(camera, points - middle, detection.pixels, rotation, at) for rotation in starts)
        return min(tried, key=lambda candidate: candidate[0])

    best = refined((start.matrix, _mirrored(start.matrix, at)))
    if not _perspective_px(points - middle, detection.pixels, best[2]) > CLEAR * np.sqrt(best[0]):
        best = min(best, refined(_tilted(start.matrix, at)), key=lambda candidate: candidate[0])
    cost, rotation, at = best
    if not np.isfinite(cost):
        raise CalibrationFailedError(
            f"no pose of the board explains its {len(points)} corners: the camera or the board's description is wrong"
        )
    return Pose.from_matrix(rotation, at - rotation @ middle)


def pose_residuals(camera: Camera, board: Board, detection: Detection) -> Pixels:
    """(n, 2) px predicted minus detected, with nothing but the pose fitted; raises what `fit_pose` raises.

    NaN for a corner that the camera cannot see: where its lens model has folded back.
    """
    pose = fit_pose(camera, board, detection)
    return camera.project(pose.transform(board.points[detection.ids])) - detection.pixels


def on_one_line(points: Points) -> bool:
    """Whether points (n, 3), two or more, all lie on one line."""
    length, width, _ = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(width <= ON_A_LINE * length)


def _mirrored(rotation: Matrix, at: Vector) -> Matrix:
    """The rotation whose in-plane axes look the same from afar: their depth along the line of sight reversed."""
    sight = at / np.linalg.norm(at)
    first, second = (rotation - 2.0 * np.outer(sight, sight @ rotation)).T[:2]
    return np.column_stack([first, second, np.cross(first, second)])


def _tilted(rotation: Matrix, at: Vector) -> tuple[Matrix, ...]:
    """Rotations turned about the line of sight as the given one, but tilted to each of four sides."""
    sight = at / np.linalg.norm(at)
    normal = rotation[:, 2] * np.sign(rotation[:, 2] @ sight)
    across = np.cross(normal, sight)
    angle = np.arctan2(np.linalg.norm(across), normal @ sight)
    level = rotation_matrices(across / max(np.linalg.norm(across), 1e-12) * angle) @ rotation
    return tuple(rotation_matrices(sign * TILT * level[:, axis]) @ level for axis in (0, 1) for sign in (1, -1))


def _perspective_px(points: Points, pixels: Pixels, at: Vector) -> float:
    """By about how much perspective bends the image of points, (n, 3) about their middle, that are well tilted."""
    spread = np.linalg.norm(pixels - pixels.mean(axis=0), axis=1).max()
    return float(spread * np.linalg.norm(points, axis=1).max() / np.linalg.norm(at))


def _refined(
    camera: Camera, points: Points, pixels: Pixels, rotation: Matrix, at: Vector
) -> tuple[float, Matrix, Vector]:
    """Mean squared error (infinite where most corners have no image), rotation and place of the points' middle.

    Corners that a step moves out of the camera's sight count for nothing, on either side of the step.
    """
    error = camera.project(points @ rotation.T + at) - pixels
    used = _known(error)
    damping = 1e-4
    for _ in range(MAX_STEPS):
        if 2 * used.sum() < len(points) or used.sum() < MIN_CORNERS:
            return np.inf, rotation, at
        step, promised = _step(camera, points[used] @ rotation.T, at, error[used], damping)
        cost = _cost(error, used)
        if promised <= max(SMALL_GAIN * cost, used.sum() * EXACT_PX**2) or damping > MAX_DAMPING:
            break
        new_rotation = rotation_matrices(step[:3]) @ rotation
        new_at = at + step[3:]
        new_error = camera.project(points @ new_rotation.T + new_at) - pixels
        both = used & _known(new_error)
        if both.any() and _cost(new_error, both) < _cost(error, both):
            rotation, at, error, used = new_rotation, new_at, new_error, both
            damping *= 0.1
        else:
            damping *= 10.0
    return _cost(error, used) / used.sum(), rotation, at


def _step(camera: Camera, turned: Points, at: Vector, error: Pixels, damping: float) -> tuple[Floats, float]:
    """(6,) the damped step, a turn about the points' middle and its shift; and by how much the cost should fall."""
    _, by_point, _ = camera.lens.project_with_jacobians(turned + at, camera.params)
    jacobian = frame_jacobian(by_point, turned, shifted=True).reshape(-1, 6)
    normal, slope = jacobian.T @ jacobian, jacobian.T @ error.ravel()
    normal[np.diag_indices(6)] *= 1.0 + damping
    try:
        step: Floats = np.asarray(-np.linalg.solve(normal, slope), dtype=np.float64)
    except np.linalg.LinAlgError:  # corners on one line of sight: nothing to be gained from here
        return np.zeros(6), 0.0
    return step, float(-slope @ step)


def _known(error: Pixels) -> Mask:
    return np.asarray(np.isfinite(error).all(axis=1))


def _cost(error: Pixels, used: Mask) -> float:
    return float((error[used] ** 2).sum())
