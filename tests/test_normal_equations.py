"""Normal equations in blocks, against a dense Jacobian by numerical derivatives."""

from dataclasses import replace

import numpy as np
import pytest
from dense_equations import SHAPES, Dense, world

from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.jacobian import residuals
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.normal_equations import normal_equations
from opencsp_calib.options import SolveOptions
from opencsp_calib.schur import factorise
from opencsp_calib.unknowns import Estimate


@pytest.mark.parametrize(("shape", "aspect"), SHAPES)
@pytest.mark.parametrize("weights", ["equal", "covariance"])
def test_blocks_are_the_products_of_a_numerical_jacobian(shape, aspect, weights):
    dense = Dense(world(4, SolveOptions(board_shape=shape, pixel_aspect=aspect, weights=weights)))
    jacobian, r = dense.jacobian(), dense.residuals(np.zeros(dense.size))
    lengths = np.linalg.norm(jacobian, axis=0)
    difference = dense.matrix(dense.equations) - jacobian.T @ jacobian
    assert np.abs(difference / np.outer(lengths, lengths)).max() < 1e-7
    assert np.abs((dense.gradient(dense.equations) - jacobian.T @ r) / lengths).max() < 1e-7 * np.linalg.norm(r)
    assert dense.equations.cost == pytest.approx(r @ r, rel=1e-12)
    assert dense.equations.numbers == len(r)


# of those with more coefficients, combinations are solved for that move no pixel of so narrow a lens
@pytest.mark.parametrize("model", ["pinhole", "opencv4", "opencv5", "opencv_fisheye"])
def test_blocks_of_lens_models(model):
    lens = LENS_MODELS[model]
    camera = Camera(
        "c", model, [2700.0, 2690.0, 820.0, 620.0, *np.full(len(lens.distortion_names), 1e-3)], (1626, 1236)
    )
    dense = Dense(world(2, SolveOptions(), camera=camera))
    jacobian = dense.jacobian()
    lengths = np.linalg.norm(jacobian, axis=0)
    difference = dense.matrix(dense.equations) - jacobian.T @ jacobian
    assert np.abs(difference / np.outer(lengths, lengths)).max() < 1e-6


@pytest.mark.parametrize("kept", [True, False])
@pytest.mark.parametrize("shape", ["flat", "warp", "free"])
def test_those_of_some_views_are_those_of_a_calibration_of_them(shape, kept, monkeypatch):
    if not kept:
        monkeypatch.setattr("opencsp_calib.normal_equations.KEPT", 0)
    whole = world(12, SolveOptions(board_shape=shape, weights="covariance"))
    for views in (slice(0, None, 2), slice(1, 3)):  # of two views, many corners are seen once
        images = [view.image for view in whole.observations.used[views]]
        alone = Calibration(
            whole.camera,
            whole.observations.keeping(images),
            whole.cam_from_board[views],
            whole.board,
            "truth",
            whole.options,
        )
        found, expected = normal_equations(whole).keeping(views), normal_equations(alone)
        assert (found.numbers, found.dof) == (expected.numbers, expected.dof)
        np.testing.assert_array_equal(found.unknowns.corners, expected.unknowns.corners)
        for name in ("dense", "by_corner"):
            one, other = getattr(found, name), getattr(expected, name)
            np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(other).max(initial=0.0))
        rows, others = (np.concatenate([r.values for r in e.rows()] or [[]], axis=-1) for e in (found, expected))
        np.testing.assert_allclose(rows, others, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("views", [5, 14])
def test_rows_that_are_made_again_are_those_that_would_have_been_kept(views, monkeypatch):
    calibration = world(views, SolveOptions(board_shape="free", weights="covariance"))
    kept = normal_equations(calibration)
    monkeypatch.setattr("opencsp_calib.normal_equations.KEPT", 0)
    again = normal_equations(calibration)
    assert kept.kept_rows is not None
    assert again.kept_rows is None
    for one, other in zip(kept.rows(1, views), again.rows(1, views), strict=True):
        assert one.view == other.view
        np.testing.assert_array_equal(one.values, other.values)
    for one, other in zip(*(factorise(e).newton_step() for e in (kept, again)), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-9)


def test_gauge_steps_change_nothing_that_is_seen():
    dense = Dense(world(4, SolveOptions(board_shape="free")))
    e = dense.equations
    gauge = np.concatenate([np.zeros((e.unknowns.shared, 7)), *(part.reshape(-1, 7) for part in e.gauge())])
    assert np.linalg.matrix_rank(gauge) == 7
    scale = np.sqrt(np.diag(dense.matrix(e)))
    moved = dense.jacobian() @ (gauge / np.linalg.norm(scale[:, None] * gauge, axis=0))
    assert np.abs(moved).max() < 1e-7  # of steps whose parts alone would move residuals by one
    eigenvalues = np.linalg.eigvalsh(dense.matrix(e) / np.outer(scale, scale))
    assert (eigenvalues < 1e-12).sum() == 7


def test_degrees_of_freedom_count_what_a_gauge_leaves():
    flat, free = (Dense(world(4, SolveOptions(board_shape=shape))).equations for shape in ("flat", "free"))
    assert flat.dof == flat.numbers - 8 - 24
    assert free.dof == free.numbers - 8 - 24 - 3 * len(free.unknowns.corners) + 7


def test_outliers_and_corners_seen_once_are_left_out():
    calibration = world(4, SolveOptions(board_shape="free"))
    detections = calibration.observations.detections
    masks = [np.zeros(len(d), dtype=bool) for d in detections]
    for d, mask in zip(detections[:3], masks[:3], strict=True):
        mask[d.ids == 7] = True
    masks[0][0] = True
    used = [d.ids[~mask] for d, mask in zip(detections, masks, strict=True)]
    seen = np.bincount(np.concatenate(used), minlength=20)
    assert seen[7] <= 1
    equations = normal_equations(replace(calibration, outliers=tuple(masks)))
    np.testing.assert_array_equal(equations.unknowns.corners, np.flatnonzero(seen >= 2))
    assert equations.numbers == 2 * seen[seen >= 2].sum()


def test_residuals_are_those_of_the_calibration():
    calibration = world(3, SolveOptions())
    table = CornerTable.of(calibration.observations.detections)
    found = residuals(calibration.camera.lens, table, Estimate.of(calibration))
    np.testing.assert_allclose(found, np.concatenate(calibration.residuals), atol=1e-10)
