"""The shape of boards whose shape is known."""

import numpy as np
import pytest
from bundle_worlds import changed
from hypothesis import given, settings
from hypothesis import strategies as st
from opencsp_calib_bundle.solver import BundleSolver
from scipy.spatial.transform import Rotation

from opencsp_calib import Checkerboard, InputError, SolveOptions
from opencsp_calib.flatness import aligned, flatness, flatness_of_solved, not_flat
from opencsp_calib.synthetic import bowed, demo_camera, observe, seed_poses

BOARD = Checkerboard(9, 6, 0.05)


def test_the_nominal_board_is_flat_and_square() -> None:
    found = flatness(BOARD)
    assert found.peak_to_valley_m < 1e-15
    assert found.pitch_ratio == pytest.approx(1.0)
    assert found.shear_rad == pytest.approx(0.0, abs=1e-12)
    assert np.abs(found.in_plane_m).max() < 1e-15


@settings(max_examples=40)
@given(
    turn=st.tuples(*[st.floats(-3, 3)] * 3),
    shift=st.tuples(*[st.floats(-5, 5)] * 3),
    scale=st.floats(0.1, 10),
    ratio=st.floats(0.98, 1.02),
    shear=st.floats(-0.02, 0.02),
    bow_mm=st.floats(0.0, 3.0),
)
def test_shape_is_told_wherever_the_board_is(
    turn: tuple, shift: tuple, scale: float, ratio: float, shear: float, bow_mm: float
) -> None:
    points = BOARD.points @ np.array([[1, 0, 0], [np.sin(shear) * ratio, np.cos(shear) * ratio, 0], [0, 0, 1]])
    heights = bowed(BOARD, bow_mm * 1e-3).points[:, 2]
    points = points + np.outer(heights, [0, 0, 1])
    found = flatness(BOARD.with_points(scale * Rotation.from_rotvec(turn).apply(points) + shift))
    assert found.pitch_ratio == pytest.approx(ratio, rel=2e-4)  # a bowed board is foreshortened where it is steep
    assert found.shear_rad == pytest.approx(shear, abs=2e-4)
    # the similarity that fits best shrinks a board with another pitch by half of that
    assert found.peak_to_valley_m == pytest.approx(bow_mm * 1e-3, rel=0.03, abs=1e-12)


def test_a_tilted_board_is_as_flat_as_a_level_one() -> None:
    tilted = BOARD.with_points(BOARD.points + np.outer(0.01 * BOARD.points[:, 0], [0, 0, 1]))
    assert flatness(tilted).peak_to_valley_m < 1e-12


def test_alignment_is_the_best_there_is() -> None:
    rng = np.random.default_rng(1)
    points, target = rng.normal(size=(20, 3)), rng.normal(size=(20, 3))
    best = ((aligned(points, target) - target) ** 2).sum()
    for _ in range(50):
        turn = Rotation.from_rotvec(rng.normal(0, 0.01, 3))
        near = (1 + rng.normal(0, 0.01)) * turn.apply(aligned(points, target)) + rng.normal(0, 0.01, 3)
        assert best <= ((near - target) ** 2).sum()


def test_points_are_not_aligned_by_mirroring_them() -> None:
    points = np.random.default_rng(1).normal(size=(20, 3))
    assert np.abs(aligned(points * [-1, 1, 1], points) - points).max() > 0.1


def test_only_corners_that_were_seen_count_and_the_limit_is_the_seeds() -> None:
    camera, board = demo_camera(), bowed(BOARD, 0.001)
    seen = observe(camera, board, seed_poses(BOARD, camera, 8, 1), nominal=BOARD)
    seen = changed(seen, lambda _, detection: detection.keeping(detection.ids != 0))
    solved = BundleSolver().solve(seen, "opencv4", SolveOptions(board_shape="free"))
    found = flatness_of_solved(solved)
    assert len(found.ids) == 53
    assert 0 not in found.ids
    middle = bowed(BOARD, 0.001).points[1:, 2]
    assert found.peak_to_valley_m == pytest.approx(np.ptp(middle), rel=0.1)
    (problem,) = not_flat(solved)
    assert "0.5 mm" in problem.message
    flat = observe(camera, BOARD, seed_poses(BOARD, camera, 8, 1))
    assert not_flat(BundleSolver().solve(flat, "opencv4", SolveOptions(board_shape="free"))) == ()


def test_three_corners_or_a_line_have_no_shape() -> None:
    for ids in ([0, 1, 9], [0, 1, 2, 3, 4]):
        with pytest.raises(InputError, match="four corners"):
            flatness(BOARD, np.array(ids))
