"""Information of views: against the covariance of a solved calibration, by its limits, and by worlds solved again."""

from dataclasses import replace

import numpy as np
import pytest
from opencsp_calib_bundle.solver import BundleSolver

from opencsp_calib import Camera, Checkerboard, SolveOptions
from opencsp_calib.comparison import compare
from opencsp_calib.detection import Detection
from opencsp_calib.information import FLAT, ProjectionGoal, view_information
from opencsp_calib.normal_equations import normal_equations
from opencsp_calib.projection_sigma import camera_sigma_map
from opencsp_calib.schur import factorise
from opencsp_calib.synthetic import demo_camera, observe, random_poses, seed_poses

BOARD = Checkerboard(9, 6, 0.1)
CAMERA = demo_camera()
NOISE_PX = 0.1
FISHEYE = Camera("fisheye", "opencv_fisheye", np.array([1100.0, 1101, 812, 617, 0.01, -0.003, 0, 0]), (1626, 1236))
RATIONAL = Camera("rational", "opencv8", np.array([*CAMERA.params, 0.01, 0.02, 0.01, 0.005]), CAMERA.image_size)


def informations(camera, poses, options=FLAT):
    seen = observe(camera, BOARD, poses)
    return view_information(camera, BOARD, seen.detections, poses, options=options, sigma_px=NOISE_PX)


@pytest.mark.parametrize("camera", [CAMERA, FISHEYE], ids=["opencv4", "fisheye"])
@pytest.mark.parametrize("aspect", [None, 1.0])
@pytest.mark.parametrize("shape", ["flat", "warp"])
@pytest.mark.parametrize("range_m", [None, 3.0])
def test_variance_is_that_of_the_solved_calibration(camera, aspect, shape, range_m):
    """The covariance of the solver's normal equations, which have no prior and all poses at once."""
    options = SolveOptions(pixel_aspect=aspect, board_shape=shape)
    if aspect:
        camera = replace(camera, params=[camera.params[0], camera.params[0], *camera.params[2:]])
    poses = random_poses(BOARD, camera, 12, 1, tilt_deg=(10, 50), fill=(0.3, 0.9))
    solved = BundleSolver().solve(observe(camera, BOARD, poses), camera.model, options)
    covariance = NOISE_PX**2 * factorise(normal_equations(solved)).camera_covariance
    expected = camera_sigma_map(camera, covariance, range_m).rms_px
    goal = ProjectionGoal.of(camera, BOARD, range_m, options=options)
    predicted = np.sqrt(goal.variance_px2(informations(camera, poses, options).sum(axis=0)))
    assert predicted == pytest.approx(expected, rel=0.01)


def test_variance_is_what_worlds_solved_again_scatter_by():
    poses = seed_poses(BOARD, CAMERA, 6, rng=3)
    predicted = ProjectionGoal.of(CAMERA, BOARD).variance_px2(informations(CAMERA, poses).sum(axis=0))
    squares = []
    for seed in range(20):
        seen = observe(CAMERA, BOARD, poses, noise_px=NOISE_PX, rng=seed)
        solved = BundleSolver().solve(seen, CAMERA.model, SolveOptions())
        squares.append(compare(CAMERA, solved.camera).rms_px ** 2)
    # about five parameters matter; 100 squares know a variance to 14 %
    assert np.mean(squares) == pytest.approx(predicted, rel=0.4)


@pytest.mark.parametrize("camera", [CAMERA, FISHEYE, RATIONAL], ids=lambda c: c.model)
def test_more_views_never_tell_less(camera):
    information = informations(camera, random_poses(BOARD, camera, 10, 2))
    goal = ProjectionGoal.of(camera, BOARD)
    variances = goal.variance_px2(np.cumsum(information, axis=0))
    assert (np.diff(variances) < 0).all()
    gains = goal.gains(information[:5].sum(axis=0), information[5:])
    assert ((gains > 0) & (gains < 1)).all()
    assert 1 - gains[0] == pytest.approx(variances[5] / variances[4])


def test_a_view_of_something_new_gains_more_than_the_same_again():
    tilted = random_poses(BOARD, CAMERA, 6, 5, tilt_deg=(35, 40))
    head_on = random_poses(BOARD, CAMERA, 6, 6, tilt_deg=(0, 1))
    known = informations(CAMERA, head_on)
    goal = ProjectionGoal.of(CAMERA, BOARD)
    again, new = (goal.gains(known.sum(axis=0), part) for part in (known, informations(CAMERA, tilted)))
    assert new.min() > again.max()


def test_a_turned_board_tells_its_spacings_apart():
    """All views one way up: fx/fy and the board's spacings are one, until a view is turned by 90 degrees."""
    upright = random_poses(BOARD, CAMERA, 8, 5, tilt_deg=(30, 45), roll_deg=(-3, 3))
    turned = random_poses(BOARD, CAMERA, 4, 6, tilt_deg=(30, 45), roll_deg=(87, 93))
    warp = SolveOptions(board_shape="warp")
    known = informations(CAMERA, upright, warp).sum(axis=0)
    gains = ProjectionGoal.of(CAMERA, BOARD, options=warp).gains(known, informations(CAMERA, [*upright, *turned], warp))
    assert gains[8:].min() > 2 * gains[:8].max()


def test_a_view_that_shows_too_little_tells_nothing():
    pose = random_poses(BOARD, CAMERA, 1, 1)[0]
    seen = observe(CAMERA, BOARD, [pose]).detections[0]
    few = seen.keeping(np.isin(seen.ids, [0, 8, 45]))  # six numbers, as many as a pose
    everything, little, nothing = view_information(CAMERA, BOARD, [seen, few, Detection.nothing("")], [pose] * 3)
    assert (nothing == 0).all()
    assert np.abs(little).max() < 1e-9 * np.abs(everything).max()
