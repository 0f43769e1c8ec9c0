"""What speaks for the board's shape, read from one linearisation, is what solving would find."""

from dataclasses import replace

import numpy as np
import pytest
from opencsp_calib_bundle.solver import BundleSolver

from opencsp_calib import Calibration, Checkerboard, Observations, SolveOptions
from opencsp_calib.comparison import compare
from opencsp_calib.projection_sigma import camera_sigma_map
from opencsp_calib.resampling import compare_halves, leaving_each_out
from opencsp_calib.shape_evidence import Evidence, evidence_of
from opencsp_calib.synthetic import bowed, demo_camera, observe, seed_poses
from opencsp_calib.uncertainty import jackknife_covariance

BOARD = Checkerboard(9, 6, 0.1)
CAMERA = demo_camera()
FLAT, FREE = SolveOptions(), SolveOptions(board_shape="free")


def solved(observations: Observations, options: SolveOptions) -> Calibration:
    return BundleSolver().solve(observations, "opencv4", options)


def world(views: int, bow_m: float, noise_px: float, seed: int = 1) -> Observations:
    poses = seed_poses(BOARD, CAMERA, views, seed)
    return observe(CAMERA, bowed(BOARD, bow_m), poses, noise_px=noise_px, rng=seed, nominal=BOARD)


@pytest.mark.parametrize("aspect", [None, 1.0])
def test_the_figures_are_those_of_solutions(aspect: float | None) -> None:
    seen, shape = world(12, 0.0003, 0.05), replace(FREE, pixel_aspect=aspect)
    flat, free = solved(seen, FLAT), solved(seen, shape)
    found = evidence_of(flat, shape)
    halves = [compare_halves(seen, lambda half, o=options: solved(half, o)).difference for options in (FLAT, shape)]
    assert (found.given_halves_px, found.solved_halves_px) == pytest.approx([h.rms_px for h in halves], rel=0.05)
    assert found.moved_px == pytest.approx(compare(flat.camera, free.camera).rms_px, rel=0.02)
    if aspect:  # once is enough for the costly part
        return
    moves = [
        solved(rest, replace(shape, guess=flat.camera)).camera.params - solved(rest, FLAT).camera.params
        for rest in leaving_each_out(seen)
    ]
    by_chance = camera_sigma_map(flat.camera, jackknife_covariance(np.array(moves))).rms_px
    assert found.sigma_px == pytest.approx(by_chance, rel=0.05)


def test_a_bias_that_both_halves_share_is_found_out() -> None:
    """A slight bow under much noise: the halves agree better with a flat board, and both are wrong by the same."""
    seen = [world(20, 0.0005, 0.1, seed) for seed in (0, 1)]
    flat, free = ([solved(one, options) for one in seen] for options in (FLAT, FREE))
    found = [evidence_of(one, FREE) for one in flat]
    assert any(one.given_halves_px < one.solved_halves_px for one in found)  # the case does occur
    assert all(one.for_shape for one in found)
    for one, other in zip(flat, free, strict=True):
        assert compare(one.camera, CAMERA).rms_px > 5 * compare(other.camera, CAMERA).rms_px


def test_a_move_within_the_accuracy_of_corners_is_no_reason() -> None:
    """Without noise chance explains nothing, so that rounding, or half a micrometre, would speak for the shape."""
    for bow_m in (0.0, 5e-7):
        found = evidence_of(solved(world(12, bow_m, 0.0), FLAT), FREE)
        assert not found.for_shape
        assert "within the accuracy of the corners" in str(found)
    assert evidence_of(solved(world(12, 2e-5, 0.0), FLAT), FREE).for_shape


@pytest.mark.parametrize(
    ("figures", "reason"),
    [
        ((2.4, 0.41, 0.91, 1.9), "halves of the views then differ by 0.41 instead of 2.4 px"),
        ((6.2, 15, 32, 15), "more than chance explains (15 px typically)"),
        ((0.41, 0.6, 0.5, 0.93), "which chance explains (0.93 px typically), and halves"),
        ((0.1, 0.01, 0.001, 0.0001), "within the accuracy of the corners"),
    ],
)
def test_only_what_decided_is_given_as_the_reason(figures: tuple[float, ...], reason: str) -> None:
    assert reason in str(Evidence(*figures))
