"""The pose of a board by a known camera: always the deepest minimum, whatever the board, the lens and the view."""

import cv2
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Detection
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.pose import Pose
from opencsp_calib.pose_fit import fit_pose, pose_residuals
from opencsp_calib.synthetic import bowed, demo_camera, observe, random_poses

BOARD = Checkerboard(7, 5, 0.04)
CAMERA = demo_camera()
FISHEYE = Camera("fisheye", "opencv_fisheye", np.array([420.0, 421, 812, 617, 0.02, -0.004, 0, 0]), (1626, 1236))


def seen(camera: Camera, board: Board, pose: Pose, noise_px: float, rng: np.random.Generator) -> Detection:
    pixels = camera.project(pose.transform(board.points))
    kept = np.isfinite(pixels).all(axis=1)
    return Detection(np.flatnonzero(kept), pixels[kept] + rng.normal(0, noise_px, (kept.sum(), 2)))


@pytest.mark.parametrize("board", [BOARD, bowed(BOARD, 0.004)], ids=["flat", "bowed"])
def test_exact_corners_give_the_exact_pose(board: Board) -> None:
    for pose in random_poses(BOARD, CAMERA, 40, 1, tilt_deg=(0, 75), fill=(0.05, 0.95)):
        found = fit_pose(CAMERA, board, seen(CAMERA, board, pose, 0.0, np.random.default_rng(0)))
        assert found.matrix == pytest.approx(pose.matrix, abs=1e-8)
        assert found.translation == pytest.approx(pose.translation, rel=1e-8, abs=1e-8)


def test_a_fisheye_finds_boards_beside_and_behind_it() -> None:
    rng = np.random.default_rng(2)
    for angle in np.radians(np.linspace(0, 110, 12)):
        towards = Rotation.from_rotvec([0.2 * angle, angle, 0.1])
        pose = Pose.from_matrix((towards * Rotation.from_rotvec(rng.normal(0, 0.4, 3))).as_matrix(), np.zeros(3))
        pose = Pose(pose.rotation, towards.apply([-0.1, 0.05, 0.6]))
        found = fit_pose(FISHEYE, BOARD, seen(FISHEYE, BOARD, pose, 0.0, rng))
        assert found.matrix == pytest.approx(pose.matrix, abs=1e-7)


def test_is_never_worse_than_opencv_nor_than_the_truth_however_noisy_and_small_the_board() -> None:
    """From afar, the two mirror poses are almost as good as each other: the better one must be taken."""
    rng = np.random.default_rng(3)
    for pose in random_poses(BOARD, CAMERA, 80, rng, tilt_deg=(0, 70), fill=(0.02, 0.3)):
        detection = seen(CAMERA, BOARD, pose, 0.7, rng)

        def cost(candidate: Pose, detection: Detection = detection) -> float:
            return float(((CAMERA.project(candidate.transform(BOARD.points)) - detection.pixels) ** 2).sum())

        _, rotation, translation = cv2.solvePnP(BOARD.points, detection.pixels, CAMERA.matrix, CAMERA.distortion)
        ours = cost(fit_pose(CAMERA, BOARD, detection))
        assert ours <= cost(Pose(rotation[:, 0], translation[:, 0])) * (1 + 1e-9)
        assert ours <= cost(pose)


def test_it_is_a_minimum() -> None:
    rng = np.random.default_rng(4)
    (pose,) = random_poses(BOARD, CAMERA, 1, 5)
    detection = seen(CAMERA, BOARD, pose, 0.5, rng)
    found = fit_pose(CAMERA, BOARD, detection)
    least = (pose_residuals(CAMERA, BOARD, detection) ** 2).sum()
    for direction in np.vstack([np.eye(6), -np.eye(6)]) * 1e-5:
        near = Pose(found.rotation + direction[:3], found.translation + direction[3:])
        assert least <= ((CAMERA.project(near.transform(BOARD.points)) - detection.pixels) ** 2).sum()


def test_four_corners_suffice_and_three_or_a_line_do_not() -> None:
    (pose,) = random_poses(BOARD, CAMERA, 1, 6)
    (detection,) = observe(CAMERA, BOARD, [pose]).detections

    def some(ids: list[int]) -> Detection:
        return detection.keeping(np.isin(detection.ids, ids))

    assert fit_pose(CAMERA, BOARD, some([0, 6, 28, 34])).matrix == pytest.approx(pose.matrix, abs=1e-7)
    for too_few in ([], [0, 6, 28], [0, 1, 2, 3, 4, 5, 6]):
        with pytest.raises(InputError, match="do not tell"):
            fit_pose(CAMERA, BOARD, some(too_few))


def test_an_impossible_view_is_a_failure_or_a_bad_fit_but_no_crash() -> None:
    rng = np.random.default_rng(7)
    for _ in range(20):
        detection = Detection(np.arange(35), rng.uniform(0, 1200, (35, 2)))
        try:
            residuals = pose_residuals(CAMERA, BOARD, detection)
        except CalibrationFailedError:
            continue
        assert not np.nanmax(np.abs(residuals)) < 50
