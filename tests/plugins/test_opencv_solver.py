"""The solver ``opencv`` against truth, against OpenCSP's stored result, and where OpenCV fails or stops short."""

import sys
from dataclasses import replace
from types import ModuleType

import numpy as np
import opencsp_calib_opencv.solver as module
import pytest
from opencsp_calib_opencv.solver import OpenCVSolver
from solver_worlds import SEED_BOARD, sandia, seed_world, worst_px

from opencsp_calib.board import Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.conformance.worlds import camera_of
from opencsp_calib.convergence import remaining_sigmas
from opencsp_calib.detection import Detection, Observations, View
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.options import SolveOptions
from opencsp_calib.synthetic import observe, random_poses

WIDE_BOARD = Checkerboard(12, 10, 0.05)


def solved(observations, model="opencv4", **options):
    return OpenCVSolver().solve(observations, model, SolveOptions(**options))


def test_it_is_what_opencsp_stores_of_sandias_images(data_dir):
    observations, expected = sandia(data_dir)
    calibration = solved(observations)
    np.testing.assert_allclose(calibration.camera.matrix, expected["intrinsic_matrix"], rtol=0, atol=1e-3)
    np.testing.assert_allclose(calibration.camera.distortion, expected["distortion_coeffs"], rtol=0, atol=1e-6)
    assert calibration.rms_px == pytest.approx(expected["calibration_error"], abs=1e-6)
    np.testing.assert_allclose(calibration.view_rms_px, expected["reprojection_errors"], rtol=0, atol=1e-5)
    rotations = [pose.rotation for pose in calibration.cam_from_board]
    np.testing.assert_allclose(rotations, expected["r_cam_object"], rtol=0, atol=1e-6)
    squares = [pose.translation / 0.05 for pose in calibration.cam_from_board]
    np.testing.assert_allclose(squares, expected["v_cam_object_cam"], rtol=0, atol=1e-4)


def test_exact_pixels_give_the_camera():
    camera, poses, observations = seed_world(50)
    calibration = solved(observations)
    assert worst_px(camera, calibration.camera) < 1e-9  # though OpenCV takes pixels in single precision
    for pose, truth in zip(calibration.cam_from_board, poses, strict=True):
        np.testing.assert_allclose(pose.transform(SEED_BOARD.points), truth.transform(SEED_BOARD.points), atol=1e-9)


@pytest.mark.parametrize(
    ("model", "noise_px"), [("opencv12", 0.0), ("opencv14", 0.0), ("opencv8", 0.1), ("opencv12", 0.1)]
)
def test_rational_models_are_solved_to_the_end_of_their_valley(model, noise_px):
    camera = camera_of(model)
    poses = random_poses(WIDE_BOARD, camera, 10, 5, tilt_deg=(10.0, 50.0), fill=(0.4, 0.95))
    calibration = solved(observe(camera, WIDE_BOARD, poses, noise_px=noise_px, rng=3), model)
    assert remaining_sigmas(calibration) < 1e-5
    assert noise_px or worst_px(camera, calibration.camera) < 1e-8


def test_fisheye_is_solved_in_double_precision():
    camera = Camera(
        "fish", "opencv_fisheye", np.array([420.0, 421.0, 640.3, 478.2, 0.02, -0.005, 0.003, -0.001]), (1280, 960)
    )
    board = Checkerboard(12, 9, 0.03)
    observations = observe(camera, board, random_poses(board, camera, 15, tilt_deg=(0, 40), fill=(0.4, 0.8)))
    assert worst_px(camera, solved(observations, "opencv_fisheye").camera) < 1e-8


@pytest.mark.parametrize("bow_m", [1e-3, 0.1])
def test_a_measured_board_that_is_not_flat_is_taken_as_it_is(bow_m):
    rng = np.random.default_rng(2)
    heights = bow_m * np.sin(4.0 * SEED_BOARD.points[:, 0]) + rng.normal(0.0, 1e-4, len(SEED_BOARD.points))
    measured = SEED_BOARD.with_points(SEED_BOARD.points + np.outer(heights, [0.0, 0.0, 1.0]))
    camera, _, observations = seed_world(20, board=measured)
    assert worst_px(camera, solved(observations).camera) < 1e-9


def test_the_pixel_aspect_is_held_and_not_for_fisheye():
    camera, _, observations = seed_world(10, noise_px=0.1)
    params = solved(observations, pixel_aspect=1.003).camera.params
    assert params[1] / params[0] == pytest.approx(1.003, rel=1e-12)
    guessed = solved(observations, pixel_aspect=1.003, guess=camera).camera
    np.testing.assert_allclose(guessed.params, params, rtol=1e-6)
    with pytest.raises(InputError, match="fisheye"):
        solved(observations, "opencv_fisheye", pixel_aspect=1.0)


def test_a_guess_for_other_images_is_refused():
    camera, _, observations = seed_world(10)
    with pytest.raises(InputError, match="1626x1236"):
        solved(observations, guess=camera.cropped(0, 0, 800, 600))


def test_a_name_comes_from_the_guess():
    camera, _, observations = seed_world(10)
    assert solved(observations, guess=camera).camera.name == camera.name


def test_opencvs_errors_are_one_line_of_ours():
    camera, _, observations = seed_world(5)
    outside = replace(camera, params=camera.params + np.array([0, 0, 3000.0, 0, 0, 0, 0, 0]))
    with pytest.raises(CalibrationFailedError, match=r"^OpenCV found no solution from 5 views: [^\n]*$"):
        solved(observations, guess=outside)


def test_what_cannot_be_true_is_not_returned():
    views = tuple(
        View(str(n), Detection(np.arange(20), np.random.default_rng(n).uniform(0, 500, (20, 2))), "used")
        for n in range(3)
    )
    with pytest.raises(CalibrationFailedError, match="opencv"):
        solved(Observations(Checkerboard(5, 4, 0.1), (640, 480), views), "opencv5")


def test_it_says_so_when_opencv_stops_short(monkeypatch):
    _, _, observations = seed_world(10, noise_px=0.1)
    assert not solved(observations).problems
    monkeypatch.setattr(module, "ITERATIONS", 1)
    short = solved(observations)
    assert remaining_sigmas(short) > 1.0
    assert [problem.code for problem in short.problems] == ["not-converged"]


def test_it_is_there_while_another_thread_loads_it(monkeypatch):
    """OpenCV's loader puts another module in its own place for a moment."""
    monkeypatch.setitem(sys.modules, "cv2", ModuleType("cv2"))
    assert OpenCVSolver().missing() is None
