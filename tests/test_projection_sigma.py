"""Uncertainty of projections: against worlds drawn from the covariance and compared, and by its limits."""

from dataclasses import replace

import numpy as np
import pytest
from opencsp_calib_bundle.solver import BundleSolver

from opencsp_calib import Calibration, Camera, Checkerboard, InputError, SolveOptions
from opencsp_calib.comparison import compare
from opencsp_calib.projection_sigma import (
    board_ranges,
    projection_covariance,
    projection_sigma,
    ray_sigma,
    sigma_map,
    sigma_over_range,
)
from opencsp_calib.synthetic import demo_camera, observe, random_poses
from opencsp_calib.uncertainty import with_uncertainty

BOARD = Checkerboard(9, 6, 0.1)
CAMERA = demo_camera()
FISHEYE = Camera("fisheye", "opencv_fisheye", np.array([1100.0, 1101, 812, 617, 0.01, -0.003, 0, 0]), (1626, 1236))


@pytest.fixture(scope="module", params=[CAMERA, FISHEYE], ids=["opencv4", "fisheye"])
def calibration(request: pytest.FixtureRequest) -> Calibration:
    camera = request.param
    poses = random_poses(BOARD, camera, 12, 1, tilt_deg=(20, 45), fill=(0.3, 0.6))
    seen = observe(camera, BOARD, poses, noise_px=0.1, rng=2)
    return with_uncertainty(BundleSolver().solve(seen, camera.model, SolveOptions()))


@pytest.mark.parametrize("range_m", [None, 3.0])
def test_is_what_comparing_cameras_drawn_from_the_covariance_shows(
    calibration: Calibration, range_m: float | None
) -> None:
    rng = np.random.default_rng(3)
    grid = (7, 5)
    predicted = sigma_map(calibration, range_m, grid=grid)
    squares = []
    for draw in rng.multivariate_normal(calibration.camera.params, calibration.covariance, 50, method="eigh"):
        other = replace(calibration.camera, params=draw)
        squares.append(compare(calibration.camera, other, range_m=range_m, grid=grid).length_px ** 2)
    scatter = np.sqrt(np.mean(squares, axis=0))
    # 50 draws of two components know a sigma to 7 to 10 %
    assert np.median(predicted.sigma_px / scatter) == pytest.approx(1.0, abs=0.15)
    assert (predicted.sigma_px / scatter) == pytest.approx(np.ones_like(scatter), abs=0.4)
    assert predicted.rms_px == pytest.approx(np.sqrt(np.mean(squares)), rel=0.2)


def test_angles_are_those_between_rays(calibration: Calibration) -> None:
    pixels = np.array([[812.0, 617.0], [100.0, 80.0], [1500.0, 1100.0]])
    camera, h = calibration.camera, 1e-3
    covariance = projection_covariance(calibration, pixels)
    moved = [camera.unproject(pixels + np.array(d) * h) - camera.unproject(pixels) for d in ((1, 0), (0, 1))]
    by_pixel = np.stack(moved, axis=2) / h
    expected = np.sqrt(np.einsum("nij,njk,nik->n", by_pixel, covariance, by_pixel))
    assert ray_sigma(calibration, pixels) == pytest.approx(expected, rel=1e-3)
    assert projection_sigma(calibration, pixels) == pytest.approx(np.sqrt(np.trace(covariance, axis1=1, axis2=2)))


def test_a_turn_of_the_camera_is_no_uncertainty_of_a_narrow_one() -> None:
    """With cx alone uncertain by 5 px: a turn of the frame, but for what grows with the square of the field of view."""
    narrow = replace(CAMERA, params=CAMERA.params * np.array([20, 20, 1, 1, 0, 0, 0, 0]))
    poses = random_poses(BOARD, CAMERA, 3, 1)
    seen = observe(CAMERA, BOARD, poses, noise_px=0.1)
    solved = BundleSolver().solve(seen, "opencv4", SolveOptions())
    doubtful = replace(solved, camera=narrow, covariance=np.diag([0, 0, 25.0, 0, 0, 0, 0, 0]))
    assert sigma_map(doubtful).rms_px < 5e-3


def test_over_range_it_is_least_where_the_boards_were(calibration: Calibration) -> None:
    near, far = board_ranges(calibration)
    ranges = np.geomspace(near / 30, far * 30, 61)
    sigmas = sigma_over_range(calibration, ranges).sigma_px
    assert near / 2 < ranges[sigmas.argmin()] < far * 2
    assert (np.diff(sigmas[: sigmas.argmin() + 1]) <= 0).all()
    assert (np.diff(sigmas[sigmas.argmin() :]) >= 0).all()
    at_infinity = sigma_over_range(calibration, [np.inf])
    assert at_infinity.sigma_px == pytest.approx(sigma_over_range(calibration, [1e9]).sigma_px, rel=1e-6)
    # at infinity a turn fitted there is the best there is: a frame fixed at the boards cannot do better
    assert at_infinity.sigma_px[0] >= sigma_map(calibration).rms_px * (1 - 1e-9)
    whole = sigma_map(calibration)
    ratios = whole.sigma_rad / whole.sigma_px  # of every pixel, by another way; their mean is between the extremes
    assert ratios.min() < at_infinity.sigma_rad[0] / at_infinity.sigma_px[0] < ratios.max()
    with pytest.raises(InputError, match="positive"):
        sigma_over_range(calibration, [0.0])


def test_finite_ranges_do_not_differ(calibration: Calibration) -> None:
    """Turn and shift undo as much at one range as at any other: documented, and so it is."""
    at_two, at_fifty = sigma_map(calibration, 2.0), sigma_map(calibration, 50.0)
    assert at_two.sigma_px == pytest.approx(at_fifty.sigma_px, rel=1e-6)


def test_pixels_without_a_ray_are_nan() -> None:
    folded = Camera("folded", "opencv4", np.array([900.0, 900, 812.5, 617.5, -0.4, 0.0, 0.0, 0.0]), (1626, 1236))
    seen = observe(CAMERA, BOARD, random_poses(BOARD, CAMERA, 6, 1), noise_px=0.05)
    solved = BundleSolver().solve(seen, "opencv4", SolveOptions())
    found = sigma_map(replace(solved, camera=folded, covariance=np.eye(8) * 1e-6))
    assert np.isnan(found.sigma_px[0, 0])
    assert np.isnan(found.sigma_rad[0, 0])
    assert np.isfinite([found.rms_px, found.worst_px]).all()
