"""Uncertainty: against full re-solves, against what many worlds do, and on Sandia's own photographs."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from opencsp_calib_bundle.solver import BundleSolver
from scipy.stats import t as student

from opencsp_calib import Calibration, Checkerboard, Observations, Pose, SolveOptions
from opencsp_calib.detection import View
from opencsp_calib.judgement import verdict
from opencsp_calib.pipeline import detect
from opencsp_calib.resampling import leaving_each_out
from opencsp_calib.synthetic import bowed, demo_camera, observe, random_poses, seed_poses
from opencsp_calib.uncertainty import (
    honest_covariance,
    influence,
    jackknife_covariance,
    student_factor,
    with_uncertainty,
)

BOARD = Checkerboard(9, 6, 0.1)
CAMERA = demo_camera()
WAYS = {
    "flat": SolveOptions(),
    "square": SolveOptions(pixel_aspect=1.0),
    "warp": SolveOptions(board_shape="warp"),
    "free": SolveOptions(board_shape="free"),
    "weighted": SolveOptions(board_shape="free", weights="covariance"),
}


def solved(observations: Observations, options: SolveOptions = WAYS["flat"]) -> Calibration:
    return BundleSolver().solve(observations, "opencv4", options)


@pytest.fixture(scope="module")
def observations() -> Observations:
    board = bowed(BOARD, 0.002)
    return observe(CAMERA, board, seed_poses(BOARD, CAMERA, 14, 3), noise_px=0.05, rng=4, nominal=BOARD)


@pytest.mark.parametrize("way", WAYS)
def test_one_newton_step_finds_what_solving_again_without_each_view_finds(way: str, observations: Observations) -> None:
    options = WAYS[way]
    if way in ("flat", "square"):  # of a bent board the residuals are so large that the second step matters (to 10 %)
        poses = seed_poses(BOARD, CAMERA, 14, 3)
        observations = observe(CAMERA, BOARD, poses, noise_px=0.05, rng=4)
    whole = solved(observations, options)
    every_other = slice(None, None, 2)
    again = [solved(rest, options).camera.params for rest in leaving_each_out(observations)[every_other]]
    again = np.array(again) - whole.camera.params
    steps = np.array([one.params for one in influence(whole)])[every_other]
    assert (np.abs(steps - again) < 0.02 * np.abs(again).max(axis=0)).all()
    full = np.sqrt(np.diag(jackknife_covariance(again)))
    assert np.sqrt(np.diag(jackknife_covariance(steps))) == pytest.approx(full, rel=0.01)


@pytest.mark.parametrize("way", ["flat", "free"])
def test_the_residual_covariance_is_the_scatter_of_worlds_whose_noise_is_independent(way: str) -> None:
    board = Checkerboard(6, 5, 0.1)
    poses = seed_poses(board, CAMERA, 8, 3)
    results = [solved(observe(CAMERA, board, poses, noise_px=0.1, rng=seed), WAYS[way]) for seed in range(25)]
    scatter = np.sqrt(np.mean([(one.camera.params - CAMERA.params) ** 2 for one in results], axis=0))
    # what a world's noise changes in its sigmas is their scale, known to 3 %
    sigmas = [np.sqrt(np.diag(with_uncertainty(one).covariance_residual)) for one in results[:4]]
    # the scatter of 25 worlds is known to 14 %, one sigma; eight parameters
    assert scatter / np.mean(sigmas, axis=0) == pytest.approx(np.ones(8), abs=0.42)


def test_is_the_dense_inverse_with_poses_marginalised(observations: Observations) -> None:
    """By numerical derivatives of every residual by every unknown, inverted as a whole."""
    small = observations.keeping([view.image for view in observations.used[:4]])
    result = with_uncertainty(solved(small))
    detections, poses = small.detections, result.cam_from_board
    start = np.concatenate([result.camera.params, *(np.r_[p.rotation, p.translation] for p in poses)])
    step = np.maximum(np.abs(start), 1e-2) * 1e-6

    def residuals(unknowns: np.ndarray) -> np.ndarray:
        camera = replace(result.camera, params=unknowns[:8])
        moved = [Pose(u[:3], u[3:]) for u in unknowns[8:].reshape(-1, 6)]
        views = zip(moved, detections, strict=True)
        return np.concatenate([camera.project(p.transform(BOARD.points[d.ids])) - d.pixels for p, d in views]).ravel()

    jacobian = np.column_stack([(residuals(start + e) - residuals(start - e)) / (2 * e.sum()) for e in np.diag(step)])
    inverse = np.linalg.inv(jacobian.T @ jacobian)[:8, :8]
    left = residuals(start)
    expected = inverse * (left @ left) / (len(left) - len(start))
    sigma = np.sqrt(np.diag(expected))
    both = np.outer(sigma, sigma)
    assert result.covariance_residual / both == pytest.approx(expected / both, abs=1e-3)


def test_outliers_count_for_nothing(observations: Observations) -> None:
    first = observations.used[0]
    pixels = first.detection.pixels.copy()
    pixels[7] += 30.0
    spoiled = replace(first, detection=replace(first.detection, pixels=pixels))
    views = tuple(spoiled if v.image == first.image else v for v in observations.views)
    without = replace(first, detection=first.detection.keeping(np.arange(len(pixels)) != 7))
    robust = solved(replace(observations, views=views), SolveOptions(robust=True))
    assert robust.rejected_corners == 1
    plain = solved(replace(observations, views=tuple(without if v.image == first.image else v for v in views)))
    assert with_uncertainty(robust).covariance == pytest.approx(with_uncertainty(plain).covariance, rel=1e-4)


@settings(max_examples=30)
@given(seed=st.integers(0, 10_000), rank=st.integers(0, 6), held=st.booleans())
def test_honest_is_the_jackknife_and_on_the_whole_not_below_the_residual_one(seed: int, rank: int, held: bool) -> None:
    rng = np.random.default_rng(seed)
    basis = np.eye(6)[:, 1:] + np.eye(6)[:, :1] * (np.arange(5) == 0) if held else np.eye(6)
    size = basis.shape[1]
    scale = 10.0 ** rng.uniform(-5, 3, size)

    def random(rank: int) -> np.ndarray:
        half = basis @ (scale[:, None] * rng.normal(size=(size, rank)))
        return half @ half.T

    residual, jackknife = random(size + 3), random(rank) * 10.0 ** rng.uniform(-1, 1)
    honest = honest_covariance(residual, jackknife, basis)
    inverse = np.linalg.pinv(basis)
    ratios = [
        np.linalg.eigvals((inverse @ c @ inverse.T) @ np.linalg.inv(inverse @ residual @ inverse.T)).real.mean()
        for c in (jackknife, honest)
    ]
    assert ratios[1] == pytest.approx(max(1.0, ratios[0]), rel=1e-5)
    if ratios[0] >= 1.0:
        assert (honest == jackknife).all()
    directions = rng.normal(size=(50, 6)) / np.maximum(basis @ scale, 1e-9)
    variances = [np.einsum("ni,ij,nj->n", directions, c, directions) for c in (honest, jackknife)]
    assert (variances[0] >= variances[1] * (1 - 1e-9)).all()
    if rank == 0:
        assert honest == pytest.approx(residual)


def test_is_honest_where_boards_flex_and_the_residual_sigma_is_not() -> None:
    """Student's t times sigma holds 95 %: of 12 worlds x 8 parameters, correlated within a world.

    200 worlds each are in ``validation/uncertainty.py``.
    """
    honest, naive = [], []
    for seed in range(12):
        poses = seed_poses(BOARD, CAMERA, 10, seed)
        result = with_uncertainty(solved(observe(CAMERA, BOARD, poses, noise_px=0.03, rng=seed, flex_m=3e-4)))
        off = np.abs(result.camera.params - CAMERA.params) / student_factor(10)
        honest.append(off < result.sigma)
        naive.append(off < np.sqrt(np.diag(result.covariance_residual)))
    assert 0.88 <= np.mean(honest) <= 0.995
    assert np.mean(naive) < 0.6


def test_student_factor_is_students() -> None:
    for views in (3, 10, 50):
        assert student_factor(views) == pytest.approx(student.ppf(0.975, views - 1))


def test_a_view_that_the_result_hangs_on_is_named() -> None:
    """Nine views nearby, and one, three times farther away and slightly wrong, which alone knows about perspective."""
    near = random_poses(BOARD, CAMERA, 9, 1, tilt_deg=(2, 12), fill=(0.8, 0.9))
    (lone,) = random_poses(BOARD, CAMERA, 1, 2, tilt_deg=(45, 50), fill=(0.9, 0.95))
    seen = observe(CAMERA, BOARD, [*near, lone], noise_px=0.02, rng=3)
    last = seen.views[-1]
    bent = bowed(BOARD, 0.002)
    wrong = observe(CAMERA, bent, [lone], noise_px=0.02, rng=5).views[0].detection
    seen = replace(seen, views=(*seen.views[:-1], View(last.image, wrong, "used")))
    result = with_uncertainty(solved(seen))
    (problem,) = [p for p in result.problems if p.code == "hangs-on-view"]
    assert last.image in problem.message
    shares = [one.share for one in influence(result)]
    assert sum(shares) == pytest.approx(1.0)
    assert np.argmax(shares) == 9
    assert shares[9] > 0.5


def test_a_good_set_hangs_on_no_view() -> None:
    for seed in range(3):
        seen = observe(CAMERA, BOARD, seed_poses(BOARD, CAMERA, 20, seed), noise_px=0.05, rng=seed)
        assert not any(p.code == "hangs-on-view" for p in with_uncertainty(solved(seen)).problems)


def test_a_camera_that_may_be_off_by_anything_is_said_to_be_undetermined() -> None:
    """Three views of seven poor corners each."""
    seen = observe(CAMERA, BOARD, seed_poses(BOARD, CAMERA, 3, 0), noise_px=0.8, rng=3)
    few = np.isin(np.arange(54), [0, 8, 45, 53, 22, 13, 30])
    views = tuple(replace(view, detection=view.detection.keeping(few)) for view in seen.views)
    result = with_uncertainty(BundleSolver().solve(replace(seen, views=views), "opencv5", WAYS["flat"]))
    assert result.problems[0].code == "undetermined"
    assert np.isfinite(result.sigma).all()
    assert verdict(result).level == "bad"


def test_known_uncertainty_is_not_computed_again(observations: Observations) -> None:
    result = with_uncertainty(solved(observations))
    assert with_uncertainty(result) is result


def test_two_views_have_no_honest_sigma_and_it_is_said() -> None:
    seen = observe(CAMERA, BOARD, seed_poses(BOARD, CAMERA, 2, 6), noise_px=0.02, rng=1)
    result = with_uncertainty(solved(seen))
    assert np.isnan(result.sigma).all()
    assert np.isfinite(result.covariance_residual).all()
    assert "two views" in result.problems[-1].message


def test_sandias_photographs(data_dir: Path) -> None:
    """Measured before this was written, by a prototype: residuals 0.29 and 0.055 px, jackknife 6.2 and 0.28 px.

    View 010, the only one at another range, moves cx by 6.7 px when left out. (Published with the project's evidence;
    corners here are found by other code, so a third is left for that.)
    """
    seen = detect(data_dir / "sandia_checkerboard", Checkerboard(18, 23, 0.05))
    options = SolveOptions(board_shape="free", pixel_aspect=1.0, weights="covariance", robust=True)
    result = with_uncertainty(solved(seen, options))
    naive = np.sqrt(np.diag(result.covariance_residual))
    assert result.sigma[2] == pytest.approx(6.2, rel=1 / 3)
    assert result.sigma[0] == pytest.approx(0.28, rel=1 / 3)
    assert naive[2] == pytest.approx(0.29, rel=1 / 3)
    assert naive[0] == pytest.approx(0.055, rel=1 / 3)
    most = max(influence(result), key=lambda one: one.share)
    assert most.image == "010.png"
    assert most.params[2] == pytest.approx(6.7, rel=0.15)
    assert any(p.code == "hangs-on-view" and "010.png" in p.message for p in result.problems)


@pytest.mark.parametrize("way", ["flat", "free"])
def test_exact_corners_hang_on_nothing_and_break_nothing(way: str) -> None:
    seen = observe(CAMERA, BOARD, seed_poses(BOARD, CAMERA, 8, 1))
    result = with_uncertainty(solved(seen, WAYS[way]))
    views = zip(seen.used, result.cam_from_board, strict=True)
    exact = tuple(
        replace(v, detection=replace(v.detection, pixels=result.camera.project(p.transform(result.board.points))))
        for v, p in views
    )
    to_the_bit = replace(result, observations=replace(seen, views=exact), residuals=None, covariance=None)
    for one in (result, with_uncertainty(to_the_bit)):
        assert (one.sigma > 0).all()
        assert (one.sigma[:4] < 1e-6).all()
        assert not any(p.code == "hangs-on-view" for p in one.problems)


def test_views_that_do_not_determine_the_camera_are_said_to() -> None:
    """All head-on: the focal length is open. The solver refuses; here its last guess comes from elsewhere."""
    level = random_poses(BOARD, CAMERA, 6, 1, tilt_deg=(0.0, 1e-6), fill=(0.9, 0.9))
    seen = observe(CAMERA, BOARD, level, noise_px=0.0)
    bare = replace(CAMERA, params=[*CAMERA.params[:4], 0, 0, 0, 0])
    guess = Calibration(bare, seen, level, BOARD, "by hand", WAYS["flat"])
    result = with_uncertainty(guess)
    assert np.isnan(result.sigma).all() or result.sigma[0] > 1e3
