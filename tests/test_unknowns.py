"""What is solved for: the camera's parameters and the board's warps."""

import numpy as np
from dense_equations import BOARD
from scipy.spatial.transform import Rotation

from opencsp_calib.board import Checkerboard
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.options import SolveOptions
from opencsp_calib.unknowns import Unknowns, warp_basis


def test_held_aspect_moves_both_focal_lengths():
    unknowns = Unknowns.of(LENS_MODELS["opencv4"], BOARD, np.arange(0), SolveOptions(pixel_aspect=1.25))
    assert unknowns.camera.shape == (8, 7)
    np.testing.assert_array_equal(unknowns.camera @ np.eye(7)[0], [1.0, 1.25, 0, 0, 0, 0, 0, 0])


def test_warps_change_a_boards_shape_and_nothing_else():
    board = Checkerboard(columns=9, rows=6, spacing_m=0.02)
    basis = warp_basis(board)
    assert np.linalg.matrix_rank(basis.reshape(-1, 5)) == 5
    for shift in basis.transpose(2, 0, 1):
        assert 0.2 < np.abs(shift).max() < 2.0
        assert np.abs(shift.mean(axis=0)).max() < 1e-12
        turn, _ = Rotation.align_vectors(
            board.points + 1e-4 * shift - board.points.mean(axis=0), board.points - board.points.mean(axis=0)
        )
        assert turn.magnitude() < 1e-7
        assert abs((shift * (board.points - board.points.mean(axis=0))).sum()) < 1e-12
