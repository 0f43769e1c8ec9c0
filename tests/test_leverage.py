"""What single views weigh: against dense matrices, and whether intervals hold what they say where they weigh much."""

from dataclasses import replace

import numpy as np
import pytest
from dense_equations import SHAPES, Dense, scaled_pinv, without_view, world
from scipy.stats import t as student

from opencsp_calib.leverage import growth_without_each_view, jackknife_correction, sigmas_that_hold
from opencsp_calib.options import SolveOptions
from opencsp_calib.schur import factorise
from opencsp_calib.uncertainty import jackknife_covariance


@pytest.mark.parametrize(("shape", "aspect"), SHAPES)
def test_growth_is_that_of_dense_covariances(shape, aspect):
    dense = Dense(world(12, SolveOptions(board_shape=shape, pixel_aspect=aspect)))
    equations = dense.equations
    cameras = slice(dense.unknowns.camera.shape[1])
    whole = scaled_pinv(dense.matrix(equations))[cameras, cameras]
    whitening = np.linalg.inv(np.linalg.cholesky(whole))
    for view, found in enumerate(growth_without_each_view(factorise(equations))):
        without = scaled_pinv(dense.matrix(without_view(equations, view)))[cameras, cameras]
        expected = whitening @ (without - whole) @ whitening.T
        assert np.abs(found - expected).max() < (0.05 if shape == "free" else 1e-6) * np.abs(expected).max()


def test_views_of_equal_weight_need_no_correction():
    equations = Dense(world(12, SolveOptions())).equations
    equal = factorise(replace(equations, dense=np.repeat(equations.dense.mean(axis=0)[None], 12, axis=0)))
    assert growth_without_each_view(equal) == pytest.approx(np.tile(np.eye(8) / 11, (12, 1, 1)), abs=1e-8)
    assert jackknife_correction(equal) == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize("views", [2, 3, 10, 50, 1000])
def test_of_views_of_equal_weight_the_number_is_students_t(views):
    equal = np.full((1, views), 1 / (views - 1))
    assert sigmas_that_hold(equal)[0] == pytest.approx(student.ppf(0.975, views - 1), rel=1e-8)


@pytest.mark.parametrize(("views", "seed", "heavy"), [(6, 1, 1.0), (20, 4, 1.0), (12, 3, 20.0)])
def test_intervals_hold_what_they_say_of_views_with_independent_noise(views, seed, heavy):
    """Of 2000 draws of all views' scores, in 40 directions: linear, so that nothing but the theory is tested."""
    equations = Dense(world(views, SolveOptions(), seed)).equations
    equations.dense[0] *= heavy
    ties = equations.shared_pose
    information = equations.shared - ties @ np.linalg.solve(equations.pose, ties.transpose(0, 2, 1))
    whitening = np.linalg.inv(np.linalg.cholesky(information.sum(axis=0)))
    parts = whitening @ information @ whitening.T
    rng = np.random.default_rng(1)
    scores = np.linalg.cholesky(parts + 1e-12 * np.eye(8)) @ rng.standard_normal((2000, views, 8, 1))
    error = scores.sum(axis=1)
    steps = np.linalg.solve(np.eye(8) - parts, parts @ error[:, None] - scores)[..., 0]
    directions = rng.standard_normal((8, 40))
    variance = np.array([np.diag(directions.T @ jackknife_covariance(draw) @ directions) for draw in steps])
    sigma = jackknife_correction(factorise(equations)) * np.sqrt(variance)
    held = np.abs(error[..., 0] @ directions) < student.ppf(0.975, views - 1) * sigma
    assert 0.93 < held.mean() < 0.98
    assert held.mean(axis=0).min() > 0.9
