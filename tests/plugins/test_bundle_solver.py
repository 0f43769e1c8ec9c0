"""The solver ``bundle`` against truth, and against SciPy's and OpenCV's minima."""

from dataclasses import replace

import numpy as np
import pytest
from bundle_worlds import SMALL, changed, codes, small_world, solved
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation
from solver_worlds import SEED_BOARD, sandia, seed_world, worst_px

from opencsp_calib.board import Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.conformance.worlds import camera_of
from opencsp_calib.convergence import remaining_sigmas
from opencsp_calib.detection import Detection
from opencsp_calib.normal_equations import normal_equations
from opencsp_calib.options import SolveOptions
from opencsp_calib.resampling import held_out
from opencsp_calib.schur import CornersKept, factorise
from opencsp_calib.synthetic import bowed, demo_camera, observe, random_poses

WIDE = Camera("wide", "opencv5", [900.0, 903.0, 815.0, 590.0, -0.25, 0.07, 5e-4, -5e-4, -5e-3], (1600, 1200))
FISH = Camera("fish", "opencv_fisheye", [480.0, 481.0, 815.0, 590.0, 0.05, -0.01, 2e-3, -5e-4], (1600, 1200))


def cost(calibration):
    return sum((r[~o] ** 2).sum() for r, o in zip(calibration.residuals, calibration.outliers, strict=True))


@pytest.mark.parametrize(
    ("shape", "aspect"), [("flat", None), ("flat", 1.0), ("warp", None), ("warp", 1.0), ("free", None), ("free", 1.0)]
)
@pytest.mark.parametrize("careful", [False, True])
def test_exact_pixels_give_the_camera_and_the_board(shape, aspect, careful):
    truth = bowed(SEED_BOARD, 0.002) if shape != "flat" else SEED_BOARD
    camera, _, observations = seed_world(10, board=truth, given=SEED_BOARD)
    options = {"weights": "covariance", "robust": True} if careful else {}
    calibration = solved(observations, board_shape=shape, pixel_aspect=aspect, **options)
    assert worst_px(camera, calibration.camera) < 1e-6
    assert calibration.rejected_corners == 0
    assert calibration.rms_px < 1e-8
    turn, _ = Rotation.align_vectors(*(b.points - b.points.mean(axis=0) for b in (truth, calibration.board)))
    solved_board = turn.apply(calibration.board.points - calibration.board.points.mean(axis=0))
    scale = np.ptp(truth.points, axis=0)[0] / np.ptp(solved_board, axis=0)[0]
    np.testing.assert_allclose(scale * solved_board, truth.points - truth.points.mean(axis=0), atol=1e-8)


@pytest.mark.parametrize("views", [3, 5, 12])
@pytest.mark.parametrize("camera", [WIDE, FISH], ids=["wide", "fisheye"])
def test_wide_lenses_are_found_without_a_guess(views, camera):
    observations = small_world(views, camera=camera, seed=4)
    assert worst_px(camera, solved(observations, camera.model).camera) < 1e-6


@pytest.mark.parametrize("weights", ["equal", "covariance"])
def test_minimum_is_that_of_scipy(weights):
    """Residuals from nothing but `Camera` and `Pose`, SciPy's own derivatives and iteration."""
    rng = np.random.default_rng(5)
    spread = [
        rng.uniform(0.5, 2.0, (len(d), 1, 1)) * np.array([[0.02, 0.006], [0.006, 0.01]]) for d in [SMALL.points] * 4
    ]
    observations = changed(small_world(4, noise_px=0.1), lambda i, d: replace(d, covariance=spread[i][: len(d)]))
    ours = solved(observations, weights=weights)

    def whitened(x):
        camera = replace(ours.camera, params=x[:8] * [1e3, 1e3, 1e3, 1e3, 1, 1, 1, 1])
        rotations = Rotation.from_rotvec(x[8:].reshape(-1, 6)[:, :3]).as_matrix()
        parts = []
        for r, t, d in zip(rotations, x[8:].reshape(-1, 6)[:, 3:], observations.detections, strict=True):
            error = camera.project(SMALL.points[d.ids] @ r.T + t) - d.pixels
            factor = np.eye(2) if weights == "equal" else np.linalg.inv(np.linalg.cholesky(d.covariance))
            parts.append((factor @ error[:, :, None]).ravel())
        return np.concatenate(parts)

    poses = np.concatenate([[*p.rotation, *p.translation] for p in ours.cam_from_board])
    start = np.concatenate([ours.camera.params / [1e3, 1e3, 1e3, 1e3, 1, 1, 1, 1], poses])
    theirs = least_squares(whitened, start, jac="3-point", method="lm", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert (whitened(start) ** 2).sum() <= 2.0 * theirs.cost * (1.0 + 1e-9)
    variance = 2.0 * theirs.cost / (len(theirs.fun) - len(start))
    scale = np.array([1e3, 1e3, 1e3, 1e3, 1, 1, 1, 1])
    covariance = variance * np.linalg.inv(theirs.jac.T @ theirs.jac)[:8, :8] * np.outer(scale, scale)
    sigma = np.sqrt(np.diag(covariance))
    np.testing.assert_allclose(
        ours.covariance_residual / np.outer(sigma, sigma), covariance / np.outer(sigma, sigma), atol=1e-4
    )


@pytest.mark.parametrize("options", [{}, {"board_shape": "free", "pixel_aspect": 1.0}, {"board_shape": "warp"}])
def test_gradient_vanishes(options):
    equations = normal_equations(solved(small_world(12, noise_px=0.1, truth=bowed(SMALL, 1e-3)), **options))
    gradients = (
        (equations.shared_gradient.sum(axis=0), np.diagonal(equations.shared.sum(axis=0))),
        (equations.corner_gradient, np.diagonal(equations.corner, axis1=1, axis2=2)),
        (equations.pose_gradient, np.diagonal(equations.pose, axis1=1, axis2=2)),
    )
    for gradient, square in gradients:
        assert np.abs(gradient / np.sqrt(square)).max(initial=0.0) < 1e-9 * np.sqrt(equations.cost)


@pytest.mark.parametrize("model", ["opencv8", "opencv12"])
def test_the_end_of_a_valley_is_reached(model):
    """Where coefficients can be traded for each other, Newton's steps by JᵀJ alone come nearer by a fifth each."""
    camera = camera_of(model)
    poses = random_poses(SEED_BOARD, camera, 20, 3, tilt_deg=(10.0, 50.0), fill=(0.4, 0.95))
    calibration = solved(observe(camera, SEED_BOARD, poses, noise_px=0.15, rng=3), model)
    assert remaining_sigmas(calibration) < 1e-6


@pytest.mark.parametrize("model", ["opencv4", "opencv5"])
def test_agrees_with_opencv_and_is_not_above_it(model, data_dir):
    """OpenCV takes pixels in single precision: both are given those."""
    pytest.importorskip("cv2")
    from opencsp_calib_opencv.solver import OpenCVSolver

    for seen in (sandia(data_dir)[0], seed_world(20, 0.15)[2], small_world(25, 0.15, WIDE)):
        observations = changed(seen, lambda i, d: replace(d, pixels=d.pixels.astype(np.float32)))
        ours, theirs = solved(observations, model), OpenCVSolver().solve(observations, model, SolveOptions())
        assert cost(ours) <= cost(theirs) * (1.0 + 1e-9)
        assert worst_px(ours.camera, theirs.camera) < 1e-4


def test_openCSPs_own_result_is_found_again(data_dir):
    observations, expected = sandia(data_dir)
    calibration = solved(observations)
    matrix = expected["intrinsic_matrix"]
    np.testing.assert_allclose(calibration.camera.params[:4], matrix[[0, 1, 0, 1], [0, 1, 2, 2]], atol=1e-2)


def test_sandias_board_is_not_flat(data_dir):
    """Evidence section 1, with the seed's own corners: rms 0.191 falls to 0.037, and the views left out agree."""
    observations, _ = sandia(data_dir)
    free = {"board_shape": "free", "pixel_aspect": 1.0}
    flat, shaped = solved(observations), solved(observations, **free)
    assert flat.rms_px == pytest.approx(0.191, abs=1e-3)
    assert shaped.rms_px < 0.038
    assert np.ptp(shaped.board.points[:, 2]) == pytest.approx(1.1e-3, abs=2e-4)
    even = observations.keeping([f"{n:03}.png" for n in (2, 4, 6, 8, 10)])
    odd = observations.keeping([f"{n:03}.png" for n in (1, 3, 5, 7, 9)])
    assert held_out(((even, odd),), lambda seen: solved(seen, **free)).rms_px < 0.046


def test_free_board_has_no_shift_turn_or_scale_against_the_given_one():
    given = SMALL.with_points(SMALL.points + np.array([0.01, -0.02, 0.03]))
    observations = small_world(12, noise_px=0.05, truth=bowed(SMALL, 2e-3)).with_board(given)
    difference = solved(observations, board_shape="free").board.points - given.points
    place = given.points - given.points.mean(axis=0)
    assert np.abs(difference.mean(axis=0)).max() < 1e-12
    assert np.abs(np.cross(place, difference).sum(axis=0)).max() < 1e-12
    assert abs((place * difference).sum()) < 1e-12
    assert np.ptp(difference[:, 2]) > 1e-3


def test_free_board_costs_its_unknowns_and_seven_less():
    """Independent noise of known size: what is left of it counts the unknowns, gauge taken off."""
    sums = [cost(solved(small_world(8, noise_px=0.1, seed=seed), board_shape="free")) / 0.1**2 for seed in range(8)]
    dof = 2 * 63 * 8 - 8 - 6 * 8 - 3 * 63 + 7
    assert abs(np.mean(sums) - dof) < 3.0 * np.sqrt(2.0 * dof / 8)


def test_corners_seen_once_or_never():
    once, never = 5, 40
    full = small_world(8, truth=bowed(SMALL, 2e-3))
    seen = changed(full, lambda i, d: d.keeping((d.ids != never) & ((d.ids != once) | (i == 3))))
    calibration = solved(seen, board_shape="free")
    assert worst_px(demo_camera(), calibration.camera) < 1e-6
    np.testing.assert_array_equal(calibration.board.points[never], SMALL.points[never])
    assert calibration.rms_px < 1e-8
    assert np.abs(calibration.board.points - SMALL.points)[once].max() < 3e-3
    assert "board-corners-open" in codes(calibration)


def test_warp_finds_bend_spacing_and_shear_where_views_are_few():
    points = SMALL.points * [1.002, 0.998, 1.0] + np.outer(SMALL.points[:, 1] * 1e-3, [1.0, 0.0, 0.0])
    truth = bowed(SMALL.with_points(points), 1e-3)
    calibration = solved(small_world(4, truth=truth), board_shape="warp", pixel_aspect=1.0)
    assert worst_px(demo_camera(), calibration.camera) < 1e-2  # a bow after stretching is not quite in the warp
    assert calibration.rms_px < 1e-3


def test_held_aspect_is_held():
    camera = replace(demo_camera(), params=demo_camera().params * [1, 1.01, 1, 1, 1, 1, 1, 1])
    calibration = solved(small_world(8, camera=camera), pixel_aspect=1.01)
    assert calibration.camera.params[1] == pytest.approx(1.01 * calibration.camera.params[0], rel=1e-14)
    assert worst_px(camera, calibration.camera) < 1e-6
    sigma = np.sqrt(np.diag(solved(small_world(8, noise_px=0.1), pixel_aspect=1.0).covariance_residual))
    assert sigma[0] == pytest.approx(sigma[1], rel=1e-12)


@pytest.mark.parametrize(
    "guess",
    [
        demo_camera(),
        Camera("guess", "pinhole", [2600.0, 2600.0, 800.0, 600.0], (1626, 1236)),
        Camera("guess", "opencv_fisheye", [2600.0, 2600.0, 800.0, 600.0, 0.1, 0.0, 0.0, 0.0], (1626, 1236)),
        Camera("guess", "opencv5", [2600.0, 2600.0, 800.0, 600.0, -90.0, 0.0, 0.0, 0.0, 0.0], (1626, 1236)),
        Camera("guess", "opencv4", [200.0, 200.0, 10.0, 10.0, 0.0, 0.0, 0.0, 0.0], (1626, 1236)),
    ],
    ids=["good", "pinhole", "fisheye", "folding", "absurd"],
)
def test_any_guess_leads_to_the_same_minimum(guess):
    observations = small_world(8, noise_px=0.1)
    assert worst_px(solved(observations).camera, solved(observations, guess=guess).camera) < 1e-7


def test_far_boards_are_not_taken_for_their_mirror_images():
    """Of each view's two minima the deeper one: not above what is found from the true poses."""
    board = Checkerboard(7, 5, 0.04)
    camera = demo_camera()
    near = random_poses(board, camera, 6, 0, tilt_deg=(20.0, 45.0), fill=(0.6, 0.9))
    far = random_poses(board, camera, 20, 100, tilt_deg=(5.0, 50.0), fill=(0.04, 0.1))
    ours = solved(observe(camera, board, near + far, noise_px=0.2, rng=0))
    normals = [np.sum(a.matrix[:, 2] * b.matrix[:, 2]) for a, b in zip(ours.cam_from_board, near + far, strict=True)]
    tilts = [np.arccos(pose.matrix[2, 2]) for pose in near + far]
    mirrored = [n < np.cos(tilt) for n, tilt in zip(normals, tilts, strict=True)]
    assert sum(mirrored) <= 4  # noise of 0.2 px makes some the deeper minimum
    assert remaining_sigmas(ours) < 1e-4


def test_order_of_views_and_corners_does_not_matter():
    observations = small_world(9, noise_px=0.1)
    rng = np.random.default_rng(8)

    def mixed(_, d):
        order = rng.permutation(len(d))
        return Detection(d.ids[order], d.pixels[order], d.covariance[order])

    other = replace(changed(observations, mixed), views=changed(observations, mixed).views[::-1])
    for shape in ("flat", "free"):
        a, b = (solved(seen, board_shape=shape, robust=True, weights="covariance") for seen in (observations, other))
        assert worst_px(a.camera, b.camera) < 1e-6
        np.testing.assert_allclose(a.board.points, b.board.points, atol=1e-9)


def test_a_measured_board_is_taken_as_it_is():
    truth = bowed(SMALL, 3e-3)
    observations = small_world(8, truth=truth).with_board(truth)
    calibration = solved(observations)
    assert worst_px(demo_camera(), calibration.camera) < 1e-6
    np.testing.assert_array_equal(calibration.board.points, truth.points)


def test_with_many_views_poses_are_eliminated_instead_of_corners():
    calibration = solved(small_world(40, noise_px=0.1, truth=bowed(SMALL, 1e-3)), board_shape="free")
    assert isinstance(factorise(normal_equations(calibration)), CornersKept)
    assert worst_px(demo_camera(), calibration.camera) < 0.2
    assert remaining_sigmas(calibration) < 1e-6
