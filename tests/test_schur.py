"""Normal equations taken apart by Schur complements, against dense linear algebra."""

import numpy as np
import pytest
from dense_equations import BOARD, SHAPES, Dense, scaled_pinv, world

from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.normal_equations import normal_equations
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.schur import CornersKept, PosesKept, factorise
from opencsp_calib.synthetic import observe
from opencsp_calib.triangular import CholeskyRoot


@pytest.mark.parametrize(("shape", "aspect"), SHAPES)
@pytest.mark.parametrize("views", [5, 14])  # of a free board, once with corners eliminated, once with poses
def test_solution_and_covariance_are_those_of_the_dense_pseudo_inverse(shape, aspect, views):
    dense = Dense(world(views, SolveOptions(board_shape=shape, pixel_aspect=aspect)))
    matrix, right = dense.matrix(dense.equations), dense.gradient(dense.equations)
    factor = factorise(dense.equations)
    assert isinstance(factor, PosesKept if shape == "free" and views == 5 else CornersKept)
    solution = -np.concatenate([part.ravel() for part in factor.newton_step()])
    scale = np.sqrt(np.diag(matrix))
    assert np.abs((matrix @ solution - right) / scale).max() < 1e-9 * np.abs(right / scale).max()
    basis = dense.unknowns.camera
    q = basis.shape[1]
    expected = basis @ scaled_pinv(matrix)[:q, :q] @ basis.T
    sigma = np.sqrt(np.diag(expected))
    assert np.abs((factor.camera_covariance - expected) / np.outer(sigma, sigma)).max() < 1e-6


def test_views_head_on_determine_nothing():
    camera = Camera("c", "pinhole", [1000.0, 1000.0, 500.0, 400.0], (1001, 801))
    poses = tuple(Pose(np.zeros(3), [x, -0.07, 1.0]) for x in (-0.2, -0.1, 0.0))
    calibration = Calibration(camera, observe(camera, BOARD, poses), poses, BOARD, "truth", SolveOptions())
    with pytest.raises(np.linalg.LinAlgError):
        factorise(normal_equations(calibration))


def test_root_solves_whatever_its_size():
    rng = np.random.default_rng(0)
    for size in (1, 63, 64, 65, 200):
        half = rng.normal(size=(size, size))
        matrix = half @ half.T + size * np.eye(size)
        right = rng.normal(size=(size, 3))
        root = CholeskyRoot.of(matrix.copy())
        np.testing.assert_allclose(matrix @ root.solve(right), right, atol=1e-10)
        np.testing.assert_allclose(np.tril(root.lower) @ root.solve_lower(right), right, atol=1e-10)
    with pytest.raises(np.linalg.LinAlgError):
        CholeskyRoot.of(-np.eye(3))
