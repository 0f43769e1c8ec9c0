"""Synthetic worlds are what they say: by OpenCV's projection, and by statistics of many draws."""

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from opencsp_calib import Camera, CharucoBoard, Checkerboard, InputError, Pose
from opencsp_calib.synthetic import bowed, demo_camera, observe, outline, pose_in_view, random_poses, seed_poses

BOARD = Checkerboard(21, 18, 0.05)


def tilt_deg(pose: Pose) -> float:
    normal = cv2.Rodrigues(pose.rotation)[0][:, 2]
    return float(np.rad2deg(np.arccos(normal[2])))


def project_with_cv2(camera: Camera, points: np.ndarray, pose: Pose) -> np.ndarray:
    return cv2.projectPoints(points, pose.rotation, pose.translation, camera.matrix, camera.distortion)[0][:, 0]


def test_seed_poses_follow_the_seeds_procedure() -> None:
    camera = demo_camera()
    poses = seed_poses(BOARD, camera, views=50, rng=3)
    assert len(poses) == 50
    tilts = np.array([tilt_deg(pose) for pose in poses])
    assert tilts.min() > 29.99
    assert tilts.max() < 45.01
    along = np.array([pose.matrix[:2, 0] for pose in poses])
    horizontal = np.abs(along[:, 0]) > np.abs(along[:, 1])
    assert horizontal.sum() == 25
    normals = np.array([pose.matrix[:2, 2] for pose in poses])
    assert all(np.count_nonzero((normals * [a, b] > 0).all(axis=1)) >= 8 for a in (-1, 1) for b in (-1, 1))
    covered = np.zeros((8, 8), dtype=bool)
    for pose in poses:
        rim = project_with_cv2(camera, outline(BOARD), pose)
        assert rim.min() > 2
        assert (rim < np.array(camera.image_size) - 3).all()
        corners = project_with_cv2(camera, BOARD.points, pose) / camera.image_size
        covered[tuple((corners[:, ::-1] * 8).astype(int).T)] = True
        assert np.ptp(corners, axis=0).max() > 0.5
    assert covered.all(), "the views together reach every part of the image"


@settings(max_examples=25)
@given(
    columns=st.integers(3, 30),
    rows=st.integers(3, 30),
    focal=st.floats(600, 6000),
    model=st.sampled_from(["pinhole", "opencv4", "opencv_fisheye"]),
    seed=st.integers(0, 1000),
)
def test_random_poses_show_the_whole_board(columns: int, rows: int, focal: float, model: str, seed: int) -> None:
    distortion = [] if model == "pinhole" else [-0.05, 0.01, 0.0, 0.0]
    camera = Camera("any", model, np.array([focal, focal, 650.0, 470.0, *distortion]), (1280, 960))
    board = Checkerboard(columns, rows, 0.03)
    for pose in random_poses(board, camera, 3, seed, tilt_deg=(10, 50), fill=(0.3, 0.8)):
        rim = camera.project(pose.transform(outline(board)))
        assert (rim > 2).all()
        assert (rim < [1277, 957]).all()
        assert 9.9 < tilt_deg(pose) < 50.1


def test_a_pose_fills_and_lies_where_asked() -> None:
    camera = demo_camera()
    pose = pose_in_view(BOARD, camera, np.eye(3), 0.5, (1.0, 0.0))
    rim = project_with_cv2(camera, outline(BOARD), pose)
    assert (np.ptp(rim, axis=0) / camera.image_size).max() == pytest.approx(0.5, abs=0.01)
    assert rim[:, 0].max() == pytest.approx(1626 - 5, abs=1)
    assert rim[:, 1].min() == pytest.approx(4, abs=1)
    ids = project_with_cv2(camera, BOARD.points, pose).reshape(18, 21, 2)
    assert ids[0, 0, 0] < ids[0, 20, 0], "columns run along the image's x: not mirrored"
    assert ids[0, 0, 1] < ids[17, 0, 1]


def test_observations_are_exact_projections() -> None:
    camera, board = demo_camera(), bowed(BOARD, 0.0015)
    poses = seed_poses(board, camera, views=4)
    observations = observe(camera, board, poses)
    assert observations.image_size == (1626, 1236)
    assert observations.board == BOARD, "the observer takes the board for flat"
    for pose, detection in zip(poses, observations.detections, strict=True):
        assert detection.covariance is None
        assert len(detection) == 378
        np.testing.assert_allclose(detection.pixels, project_with_cv2(camera, board.points, pose), atol=1e-9)


def test_the_bow_is_as_high_as_asked() -> None:
    heights = bowed(BOARD, 0.0015).points[:, 2].reshape(18, 21)
    assert np.ptp(heights) == pytest.approx(0.0015, rel=0.01)
    assert heights[[0, 0, -1, -1], [0, -1, 0, -1]] == pytest.approx(np.zeros(4), abs=1e-15)
    assert np.unravel_index(heights.argmax(), heights.shape)[1] == 10


def test_corners_out_of_view_are_left_out() -> None:
    camera = demo_camera()
    pose = pose_in_view(BOARD, camera, np.eye(3), 0.9)
    half_out = Pose(pose.rotation, pose.translation + np.array([0.6, 0.0, 0.0]))
    far_out = Pose(pose.rotation, pose.translation + np.array([60.0, 0.0, 0.0]))
    observations = observe(camera, BOARD, [half_out, far_out])
    assert [view.status for view in observations.views] == ["used", "no board"]
    detection = observations.detections[0]
    expected = project_with_cv2(camera, BOARD.points, half_out)
    np.testing.assert_array_equal(detection.ids, np.flatnonzero(expected[:, 0] <= 1625.5))
    assert 0 < len(detection) < 378


def residuals(views: int = 400, **noise: float) -> np.ndarray:
    camera = demo_camera()
    pose = pose_in_view(BOARD, camera, np.eye(3), 0.8)
    observations = observe(camera, BOARD, [pose] * views, rng=5, **noise)
    truth = project_with_cv2(camera, BOARD.points, pose)
    return np.array([d.pixels - truth for d in observations.detections]).reshape(views, 18, 21, 2)


def test_noise_is_as_strong_as_asked_and_independent() -> None:
    error = residuals(noise_px=0.1)
    assert error.std() == pytest.approx(0.1, rel=0.01)
    assert abs((error[:, 1:] * error[:, :-1]).mean()) < 0.01 * 0.01
    assert abs((error[1:] * error[:-1]).mean()) < 0.01 * 0.01
    covariance = (
        observe(demo_camera(), BOARD, seed_poses(BOARD, demo_camera(), 1), noise_px=0.1).detections[0].covariance
    )
    np.testing.assert_allclose(covariance, np.tile(0.01 * np.eye(2), (378, 1, 1)))


def test_noise_of_neighbours_is_correlated_as_asked() -> None:
    error = residuals(noise_px=0.1, correlation=0.4) / 0.1
    assert error.std(axis=(0, 3)) == pytest.approx(np.ones((18, 21)), abs=0.1)
    assert (error[:, 1:] * error[:, :-1]).mean() == pytest.approx(0.4, abs=0.01)
    assert (error[:, :, 1:] * error[:, :, :-1]).mean() == pytest.approx(0.4, abs=0.01)
    assert (error[:, 1:, 1:] * error[:, :-1, :-1]).mean() == pytest.approx(0.16, abs=0.01)
    assert (error[..., 0] * error[..., 1]).mean() == pytest.approx(0.0, abs=0.01)
    with pytest.raises(InputError, match="correlation"):
        residuals(1, correlation=1.0)


def test_flex_is_as_high_as_asked_and_differs_from_view_to_view() -> None:
    camera = demo_camera()
    pose = pose_in_view(BOARD, camera, np.eye(3), 0.8)
    observations = observe(camera, BOARD, [pose] * 300, flex_m=2e-4, rng=1)
    points = pose.transform(BOARD.points)
    raised = points + 1e-3 * pose.matrix[:, 2]
    per_metre = (camera.project(raised) - camera.project(points)) / 1e-3
    far_from_axis = np.hypot(*per_metre.T) > 100  # where a height shows clearly
    heights = np.array([((d.pixels - camera.project(points)) * per_metre).sum(1) for d in observations.detections])
    heights = heights[:, far_from_axis] / (per_metre[far_from_axis] ** 2).sum(1)
    assert np.sqrt((heights**2).mean()) == pytest.approx(2e-4, rel=0.2)
    assert abs((heights[1:] * heights[:-1]).mean()) < 0.1 * 4e-8


def test_seeds_repeat() -> None:
    camera = demo_camera()
    assert seed_poses(BOARD, camera, 3, rng=1) == seed_poses(BOARD, camera, 3, rng=1)
    assert seed_poses(BOARD, camera, 3, rng=1) != seed_poses(BOARD, camera, 3, rng=2)


def test_charuco_boards_can_be_placed_too() -> None:
    board = CharucoBoard(5, 4, 0.05, 0.03, "DICT_4X4_50")
    detections = observe(demo_camera(), board, seed_poses(board, demo_camera(), 2)).detections
    assert [len(d) for d in detections] == [12, 12]


def test_a_camera_that_cannot_see_the_board_so_is_told() -> None:
    with pytest.raises(InputError, match="ask for less"):
        pose_in_view(BOARD, demo_camera(), np.eye(3), 5000.0)
