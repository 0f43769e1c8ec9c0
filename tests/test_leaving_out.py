"""The camera without each view in turn, against normal equations made without it."""

from dataclasses import replace

import numpy as np
import pytest
from dense_equations import SHAPES, Dense, at_minimum, scaled_pinv, without_view, world

from opencsp_calib.leaving_out import camera_without_each_view
from opencsp_calib.normal_equations import linearise
from opencsp_calib.options import SolveOptions
from opencsp_calib.schur import factorise


@pytest.mark.parametrize(("shape", "aspect"), SHAPES)
def test_leaving_out_a_view_is_the_newton_step_without_it(shape, aspect):
    dense = Dense(world(12, SolveOptions(board_shape=shape, pixel_aspect=aspect)))
    equations = at_minimum(dense)
    basis = dense.unknowns.camera
    sigma = np.sqrt(np.diag(factorise(equations).camera_covariance))
    found = camera_without_each_view(factorise(equations))
    for view, step in enumerate(found):
        without = without_view(equations, view)
        expected = basis @ (-scaled_pinv(dense.matrix(without)) @ dense.gradient(without))[: basis.shape[1]]
        assert np.abs((step - expected) / sigma).max() < 1e-5


@pytest.mark.parametrize("shape", ["flat", "free"])
def test_views_left_out_away_from_the_minimum_are_counted_from_where_all_lead(shape):
    equations = Dense(world(12, SolveOptions(board_shape=shape))).equations
    whole = factorise(equations)
    ahead = whole.step_without_poses()
    sigma = np.sqrt(np.diag(whole.camera_covariance))
    found = camera_without_each_view(whole, ahead=ahead)
    assert np.abs(camera_without_each_view(whole, ahead=ahead, tolerance=1e-2) / sigma - found / sigma).max() < 1e-2
    for view in (0, 7):
        rest = np.arange(12) != view
        seen = tuple(detection for detection, kept in zip(equations.table.detections, rest, strict=True) if kept)
        table = replace(equations.table, detections=seen)
        estimate = equations.estimate
        part = replace(estimate, rotations=estimate.rotations[rest], translations=estimate.translations[rest])
        step = factorise(linearise(equations.lens, table, part, equations.unknowns)).newton_step()
        expected = equations.unknowns.of_camera(step[0] - ahead[: len(step[0])])
        assert np.abs((found[view] - expected) / sigma).max() < 1e-5
