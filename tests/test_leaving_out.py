"""The camera without each view in turn, against normal equations made without it."""

from dataclasses import replace

import numpy as np
import pytest
from dense_equations import SHAPES, Dense, at_minimum, scaled_pinv, world

from opencsp_calib.corner_table import CornerTable
from opencsp_calib.detection import Detection
from opencsp_calib.leaving_out import camera_without_each_view
from opencsp_calib.normal_equations import linearise
from opencsp_calib.options import SolveOptions
from opencsp_calib.schur import factorise
from opencsp_calib.unknowns import Estimate


@pytest.mark.parametrize(("shape", "aspect"), SHAPES)
def test_leaving_out_a_view_is_the_newton_step_without_it(shape, aspect):
    dense = Dense(world(12, SolveOptions(board_shape=shape, pixel_aspect=aspect)))
    equations = at_minimum(dense)
    basis = dense.unknowns.camera
    sigma = np.sqrt(np.diag(factorise(equations).camera_covariance))
    found = camera_without_each_view(factorise(equations))
    for view, step in enumerate(found):
        rest = np.arange(len(found)) != view
        table, estimate = equations.table, equations.estimate
        part = Estimate(estimate.params, estimate.rotations[rest], estimate.translations[rest], estimate.points)
        seen = [Detection(table.ids[s], table.pixels[s]) for v in np.flatnonzero(rest) for s in [table.span(v, v + 1)]]
        without = linearise(equations.lens, CornerTable.of(seen), part, equations.unknowns)
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
