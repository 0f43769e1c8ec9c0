"""The solver ``colmap`` against truth: half pixel, a free gauge, and what COLMAP passes over in silence."""

import numpy as np
import pytest
from opencsp_calib_colmap.cameras import MODELS, colmap_params, our_params
from opencsp_calib_colmap.solver import ColmapSolver
from solver_worlds import SEED_BOARD, seed_world, worst_px

from opencsp_calib.camera import Camera
from opencsp_calib.convergence import remaining_sigmas
from opencsp_calib.detection import Detection, Observations, View
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose

pycolmap = pytest.importorskip("pycolmap")


def solved(observations, model="opencv4", **options):
    return ColmapSolver().solve(observations, model, SolveOptions(**options))


@pytest.mark.parametrize("model", MODELS)
def test_cameras_project_as_colmap_has_them(model):
    rng = np.random.default_rng(0)
    distortion = rng.uniform(-0.05, 0.05, len(LENS_MODELS[model].distortion_names))
    camera = Camera("a", model, np.array([800.0, 810.0, 318.2, 243.9, *distortion]), (640, 480))
    theirs = pycolmap.Camera(model=MODELS[model], width=640, height=480, params=colmap_params(camera.params))
    points = np.column_stack([rng.uniform(-0.4, 0.4, (50, 2)), np.ones(50)])
    np.testing.assert_allclose(theirs.img_from_cam(points) - 0.5, camera.project(points), rtol=0, atol=1e-9)
    np.testing.assert_array_equal(our_params(theirs.params), camera.params)


def test_exact_pixels_give_the_camera():
    camera, _, observations = seed_world(50)
    assert worst_px(camera, solved(observations).camera) < 1e-6


def test_a_free_board_takes_the_camera_off_nothing():
    """With the gauge left free the minimum is that of our own normal equations, which hold seven conditions only."""
    shape = np.random.default_rng(4).normal(0.0, 3e-4, SEED_BOARD.points.shape)
    true = SEED_BOARD.with_points(SEED_BOARD.points + shape)
    camera, _, observations = seed_world(20, board=true, given=SEED_BOARD)
    exact = solved(observations, board_shape="free")
    assert worst_px(camera, exact.camera) < 1e-5
    np.testing.assert_allclose(
        exact.camera.project(exact.cam_from_board[0].transform(exact.board.points)),
        observations.detections[0].pixels,
        atol=1e-5,
    )
    noisy = seed_world(20, board=true, given=SEED_BOARD, noise_px=0.05)[2]
    assert remaining_sigmas(solved(noisy, board_shape="free")) < 1e-3


def test_corners_seen_once_or_never_do_not_bend_the_board():
    camera, _, observations = seed_world(12)
    once, never = 5, 77
    views = []
    for number, view in enumerate(observations.views):
        keep = (view.detection.ids != never) & ((view.detection.ids != once) | (number == 3))
        views.append(View(view.image, view.detection.keeping(keep), "used"))
    seen = Observations(SEED_BOARD, observations.image_size, tuple(views))
    calibration = solved(seen, board_shape="free")
    assert worst_px(camera, calibration.camera) < 1e-5
    np.testing.assert_array_equal(calibration.board.points[never], SEED_BOARD.points[never])
    assert np.abs(calibration.board.points - SEED_BOARD.points).max() < 1e-3
    assert calibration.rms_px < 1e-5
    with pytest.raises(InputError, match="one view alone sees, and there are 1"):
        solved(seen)  # where COLMAP fails, with a message about its source


def test_corners_beside_the_camera_are_not_dropped_in_silence():
    """COLMAP leaves a fisheye's corners at 90 degrees and beyond out of the sum; we do not call that a solution."""
    camera = Camera("fish", "opencv_fisheye", np.array([300.0, 300.0, 640.0, 480.0, 0.0, 0.0, 0.0, 0.0]), (1280, 960))
    views = []
    for number, angle in enumerate(np.deg2rad([-40, -20, 0, 20, 40, 62])):
        turned = np.array([[np.cos(angle), 0, np.sin(angle)], [0, 1, 0], [-np.sin(angle), 0, np.cos(angle)]])
        middle = SEED_BOARD.points.mean(axis=0)
        pose = Pose.from_matrix(turned, turned @ [0.0, 0.0, 0.7] - turned @ middle)
        pixels = camera.project(pose.transform(SEED_BOARD.points))
        seen = np.isfinite(pixels).all(axis=1)
        views.append(View(str(number), Detection(np.flatnonzero(seen), pixels[seen]), "used"))
    with pytest.raises(CalibrationFailedError, match="right angles"):
        solved(Observations(SEED_BOARD, (1280, 960), tuple(views)), "opencv_fisheye", guess=camera)
