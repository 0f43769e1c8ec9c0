"""Where solvers start: near the truth for every lens model, board and scale."""

from dataclasses import replace

import numpy as np
import pytest
from solver_worlds import seed_world

from opencsp_calib.board import Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Observations
from opencsp_calib.errors import InputError
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.pose import Pose
from opencsp_calib.synthetic import observe, random_poses

BOARD = Checkerboard(9, 6, 0.03)


def seen(focal, model="pinhole", distortion=(), aspect=1.0, board=BOARD, size=(1200, 900), **poses):
    camera = Camera("truth", model, np.array([focal, focal * aspect, 611.0, 437.0, *distortion]), size)
    where = random_poses(board, camera, 12, 3, **({"tilt_deg": (20.0, 45.0), "fill": (0.4, 0.8)} | poses))
    return camera, where, observe(camera, board, where, noise_px=0.2, nominal=board)


def check_start(camera, poses, observations, focal=0.05, direction=0.1):
    start = initial_camera(observations, camera.model)
    assert start.params[0] == pytest.approx(camera.params[0], rel=focal)
    for pose, truth in zip(initial_poses(start, observations), poses, strict=True):
        assert np.linalg.norm((pose.matrix.T @ truth.matrix) - np.eye(3)) < 2.5 * direction
        there, wanted = (p.transform(observations.board.points.mean(axis=0)[None])[0] for p in (pose, truth))
        assert np.linalg.norm(there - wanted) < direction * np.linalg.norm(wanted)


@pytest.mark.parametrize("focal", [550.0, 800.0, 2500.0, 12000.0])
def test_a_pinhole_of_any_focal_length(focal):
    check_start(*seen(focal))


@pytest.mark.parametrize("focal", [380.0, 700.0, 2000.0])
def test_a_fisheye(focal):
    check_start(*seen(focal, "opencv_fisheye", (0.0, 0.0, 0.0, 0.0)))


def test_a_distorted_lens():
    check_start(*seen(900.0, "opencv5", (-0.25, 0.08, 0.001, 0.0, 0.0)), focal=0.15, direction=0.2)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_no_unit_matters(scale):
    board = Checkerboard(9, 6, 0.03 * scale)
    check_start(*seen(900.0, board=board))


def test_a_measured_board_in_any_frame():
    """As a coordinate measuring machine has it: far from the origin, upright, and not quite flat."""
    camera, poses, observations = seen(900.0)
    placed = Pose(np.array([1.3, -0.4, 0.8]), np.array([2.0, -1.0, 5.0]))
    rough = BOARD.points + np.random.default_rng(0).normal(0.0, 1e-4, BOARD.points.shape)
    moved = observations.with_board(BOARD.with_points(placed.transform(rough)))
    check_start(camera, [pose.after(placed.inverse()) for pose in poses], moved)


def test_corners_that_every_nth_of_would_be_on_one_line():
    """960 corners in 12 columns: 80 evenly spread ones would all be of one column."""
    check_start(*seen(900.0, board=Checkerboard(12, 80, 0.01), fill=(0.7, 0.9)))


def test_four_corners_are_enough():
    camera, poses, observations = seen(900.0)
    corners = np.isin(np.arange(54), [0, 8, 45, 53])
    views = [replace(v, detection=v.detection.keeping(corners[v.detection.ids])) for v in observations.views]
    check_start(camera, poses, Observations(BOARD, observations.image_size, tuple(views)), direction=0.2)


def test_with_the_true_camera_poses_are_exact():
    camera, poses, observations = seed_world(5)
    for pose, truth in zip(initial_poses(camera, observations), poses, strict=True):
        np.testing.assert_allclose(pose.translation, truth.translation, rtol=1e-6)
        np.testing.assert_allclose(pose.matrix, truth.matrix, atol=1e-6)


def test_a_fisheye_sees_boards_behind_itself():
    camera = Camera("fish", "opencv_fisheye", np.array([180.0, 180.0, 600.0, 450.0, 0.0, 0.0, 0.0, 0.0]), (1200, 900))
    turn = np.deg2rad(110.0)
    turned = np.array([[np.cos(turn), 0, np.sin(turn)], [0, 1, 0], [-np.sin(turn), 0, np.cos(turn)]])
    pose = Pose.from_matrix(turned, turned @ [-0.1, -0.1, 0.4])
    observations = observe(camera, BOARD, [pose])
    assert len(observations.detections[0]) == 54
    found = initial_poses(camera, observations)[0]
    np.testing.assert_allclose(found.translation, pose.translation, atol=1e-6)


def test_the_pixel_aspect_is_taken():
    _, _, observations = seen(900.0, aspect=1.25)
    params = initial_camera(observations, "opencv4", pixel_aspect=1.25).params
    assert params[1] / params[0] == pytest.approx(1.25)
    assert params[0] == pytest.approx(900.0, rel=0.05)


@pytest.mark.parametrize("model", LENS_MODELS)
@pytest.mark.parametrize("guess", ["opencv5", "opencv_fisheye"])
def test_a_guess_is_adapted_as_far_as_it_means_the_same(model, guess):
    _, _, observations = seen(900.0)
    params = np.array([800.0, 810.0, 600.0, 450.0, 0.1, 0.01, 0.002, 0.003, 0.004])
    given = Camera("old", guess, params[: len(LENS_MODELS[guess].parameter_names)], (1200, 900))
    taken = initial_camera(observations, model, given)
    assert (taken.model, taken.name) == (model, "old")
    np.testing.assert_array_equal(taken.params[:4], params[:4])
    alike = (model == "opencv_fisheye") == (guess == "opencv_fisheye")
    shared = min(len(taken.distortion), len(given.distortion)) if alike else 0
    np.testing.assert_array_equal(taken.distortion[:shared], given.distortion[:shared])
    assert not taken.distortion[shared:].any()


def test_a_guess_for_another_image_size_is_refused():
    camera, _, observations = seen(900.0)
    with pytest.raises(InputError, match="1200x900"):
        initial_camera(observations, "pinhole", camera.binned(2))
