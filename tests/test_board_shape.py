"""Whether the board's shape is solved for: decided rightly where the truth is known, and said why."""

from dataclasses import replace

import numpy as np
import pytest
from bundle_worlds import codes
from opencsp_calib_bundle.solver import BundleSolver
from scipy.spatial.transform import Rotation

from opencsp_calib import Calibration, CalibrationFailedError, Checkerboard, Observations, Pose, SolveOptions
from opencsp_calib.board_shape import decide, roll_spread_deg, solve_with_aspect
from opencsp_calib.comparison import compare
from opencsp_calib.synthetic import bowed, demo_camera, observe, random_poses, seed_poses

BOARD = Checkerboard(9, 6, 0.1)
CAMERA = demo_camera()
OPTIONS = SolveOptions()


def run(observations: Observations, options: SolveOptions) -> Calibration:
    return BundleSolver().solve(observations, "opencv4", options)


def world(
    views: int = 12, bow_m: float = 0.0, noise_px: float = 0.05, seed: int = 1, board: Checkerboard = BOARD
) -> Observations:
    true = bowed(board, bow_m)
    return observe(CAMERA, true, seed_poses(board, CAMERA, views, seed), noise_px=noise_px, rng=seed, nominal=board)


def said(calibration: Calibration) -> str:
    return " ".join(problem.message for problem in calibration.problems)


@pytest.mark.parametrize("views", [10, 20])
def test_a_bent_board_is_solved_for_and_the_camera_is_right(views: int) -> None:
    seen = world(views, bow_m=0.0015)
    found = decide(seen, OPTIONS, run)
    assert found.options == replace(OPTIONS, board_shape="free")  # the guess it started from is not kept
    assert {"board-shape-solved", "board-not-flat"} <= codes(found)
    assert "square-pixels-assumed" not in codes(found)  # half of the views are turned
    assert compare(found.camera, CAMERA).rms_px < 0.1 * compare(run(seen, OPTIONS).camera, CAMERA).rms_px


def test_a_flat_board_is_mostly_taken_as_it_is_and_else_no_harm_is_done() -> None:
    kept, decided, plain = 0, [], []

    def noted(observations: Observations, options: SolveOptions) -> Calibration:
        found = run(observations, options)
        if options.board_shape == "flat":
            plain.append(compare(found.camera, CAMERA).rms_px)
        return found

    for seed in range(8):
        found = decide(world(10, seed=seed), OPTIONS, noted)
        kept += "board-as-given" in codes(found)
        decided.append(compare(found.camera, CAMERA).rms_px)
    assert kept >= 5
    assert np.median(decided) < 1.5 * np.median(plain)


def test_what_stands_in_the_way_is_said() -> None:
    symmetric = decide(world(board=Checkerboard(9, 7, 0.1), bow_m=0.002), OPTIONS, run)
    assert "upside down" in said(symmetric)
    few = decide(world(6, bow_m=0.002), OPTIONS, run)
    assert "from 6 views" in said(few)
    measured = decide(world(bow_m=0.002).with_board(bowed(BOARD, 0.002)), OPTIONS, run)
    assert "measured" in said(measured)
    level = random_poses(BOARD, CAMERA, 12, 1, tilt_deg=(1, 4), fill=(0.7, 0.9))
    alike = decide(observe(CAMERA, BOARD, level, noise_px=0.01), OPTIONS, run)
    assert "hardly different directions" in said(alike)
    for found in (symmetric, few, measured, alike):
        assert codes(found) >= {"board-as-given"}
        assert found.options.board_shape == "flat"


def test_a_shape_that_cannot_be_solved_for_leaves_the_board_as_given() -> None:
    def unable(observations: Observations, options: SolveOptions) -> Calibration:
        if options.board_shape == "free":
            raise CalibrationFailedError("it did not converge")
        return run(observations, options)

    found = decide(world(bow_m=0.002), OPTIONS, unable)
    assert found.options.board_shape == "flat"
    assert "did not converge" in said(found)


def one_way_up() -> Observations:
    poses = random_poses(BOARD, CAMERA, 12, 3, tilt_deg=(25, 45), roll_deg=(-5, 5), fill=(0.5, 0.9))
    stretched = BOARD.with_points(BOARD.points * [1, 1.002, 1])
    return observe(CAMERA, stretched, poses, noise_px=0.02, rng=3, nominal=BOARD)


def test_pixels_are_square_where_no_view_is_turned_unless_somebody_says_otherwise() -> None:
    """The board is stretched by 0.2 %, fx = fy: taken as square the camera comes out right, and the board stretched."""
    for way, shape in ((decide, "free"), (solve_with_aspect, "free"), (solve_with_aspect, "warp")):
        found = way(one_way_up(), replace(OPTIONS, board_shape=shape), run)
        assert "square-pixels-assumed" in codes(found)
        assert found.options.pixel_aspect == 1.0
        assert found.camera.params[:2] == pytest.approx(CAMERA.params[:2], abs=0.5)
        given = way(one_way_up(), replace(OPTIONS, board_shape="free", pixel_aspect=1.0), run, aspect_given=True)
        assert "square-pixels-assumed" not in codes(given)
    open_aspect = solve_with_aspect(one_way_up(), replace(OPTIONS, board_shape="free"), run, aspect_given=True)
    assert open_aspect.options.pixel_aspect is None
    assert solve_with_aspect(one_way_up(), OPTIONS, run).options.pixel_aspect is None  # a flat board: stays free
    turned = solve_with_aspect(world(), replace(OPTIONS, board_shape="free"), run)
    assert turned.options.pixel_aspect is None


def test_a_board_upside_down_is_not_turned() -> None:
    def rolled(*degrees: float) -> float:
        tilt = Rotation.from_rotvec([0.5, 0.2, 0.0])
        turns = [(tilt * Rotation.from_euler("z", d, degrees=True)).as_matrix() for d in degrees]
        return roll_spread_deg(tuple(Pose.from_matrix(turn, np.array([0, 0, 1.0])) for turn in turns))

    assert rolled(10, 190) == pytest.approx(0.0, abs=1e-9)
    assert rolled(0, 90) == pytest.approx(90, abs=15)  # the tilt bends what is seen of the turn
    assert rolled(-80, 80) < 30
    assert rolled(3) == 0.0
