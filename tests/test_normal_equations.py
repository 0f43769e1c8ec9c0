"""Normal equations in blocks, against a dense Jacobian by numerical derivatives and dense linear algebra."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from opencsp_calib.board import Checkerboard
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.detection import Detection, Observations
from opencsp_calib.jacobian import residuals
from opencsp_calib.leaving_out import camera_without_each_view
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.normal_equations import NormalEquations, linearise, normal_equations, solvable_corners
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.schur import CornersKept, PosesKept, factorise
from opencsp_calib.synthetic import bowed, demo_camera, observe, random_poses
from opencsp_calib.triangular import CholeskyRoot
from opencsp_calib.unknowns import Estimate, Unknowns, warp_basis

BOARD = Checkerboard(columns=5, rows=4, spacing_m=0.05)
SHAPES = [("flat", None), ("flat", 1.0), ("warp", None), ("free", 1.0)]


def world(views: int, options: SolveOptions, seed: int = 3, camera: Camera | None = None) -> Calibration:
    """A calibration at the truth, a little off the minimum, whose views miss some corners."""
    camera, truth = camera or demo_camera(), bowed(BOARD, 0.002)
    poses = random_poses(truth, camera, views, seed, tilt_deg=(20.0, 50.0), fill=(0.5, 0.9))
    seen = observe(camera, truth, poses, noise_px=0.1, rng=seed)
    rng = np.random.default_rng(seed)
    some = [replace(view, detection=view.detection.keeping(rng.random(20) < 0.85)) for view in seen.views]
    observations = Observations(BOARD, seen.image_size, tuple(some))
    return Calibration(camera, observations, poses, truth, "truth", options)


class Dense:
    """The same problem as one long vector of unknowns: [shared | corners | poses]."""

    def __init__(self, calibration: Calibration) -> None:
        self.calibration, self.equations = calibration, normal_equations(calibration)
        self.unknowns = self.equations.unknowns
        m, c = self.unknowns.shared, len(self.unknowns.corners)
        self.parts = np.cumsum([m, 3 * c])
        self.size = m + 3 * c + 6 * len(calibration.cam_from_board)

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """From nothing but `Camera` and `Pose`; corners that cannot be solved for left out."""
        shared, corners, poses = np.split(x, self.parts)
        cameras = self.unknowns.camera.shape[1]
        c = self.calibration
        camera = replace(c.camera, params=c.camera.params + self.unknowns.camera @ shared[:cameras])
        points = c.board.points + self.unknowns.warp @ shared[cameras:]
        points[self.unknowns.corners] += corners.reshape(-1, 3)
        found = []
        for pose, step, d in zip(c.cam_from_board, poses.reshape(-1, 6), c.observations.detections, strict=True):
            moved = Pose.from_matrix(
                Rotation.from_rotvec(step[:3]).as_matrix() @ pose.matrix, pose.translation + step[3:]
            )
            used = np.isin(d.ids, self.unknowns.corners) if len(self.unknowns.corners) else np.ones(len(d), dtype=bool)
            whitening = (
                np.linalg.inv(np.linalg.cholesky(d.covariance))[used] if c.options.weights != "equal" else np.eye(2)
            )
            found.append(
                (whitening @ (camera.project(moved.transform(points[d.ids])) - d.pixels)[used][:, :, None]).ravel()
            )
        return np.concatenate(found)

    def jacobian(self) -> np.ndarray:
        # steps that move residuals by about a hundredth of a pixel, so that neither rounding nor curvature matters
        steps = 0.01 * np.sqrt(self.equations.numbers / np.diag(self.matrix(self.equations)))
        columns = [
            (self.residuals(h * unit) - self.residuals(-h * unit)) / (2 * h)
            for h, unit in zip(steps, np.eye(self.size), strict=True)
        ]
        return np.column_stack(columns)

    def matrix(self, equations: NormalEquations) -> np.ndarray:
        """JᵀJ put together from blocks."""
        m, end = self.parts
        views, matrix = len(equations.pose), np.zeros((end + 6 * len(equations.pose),) * 2)
        matrix[:m, :m] = equations.shared.sum(axis=0)
        matrix[m:end, :m] = equations.corner_shared.reshape(end - m, m)
        for k, block in enumerate(equations.corner):
            matrix[m + 3 * k : m + 3 * k + 3, m + 3 * k : m + 3 * k + 3] = block
        for v in range(views):
            rows = slice(end + 6 * v, end + 6 * v + 6)
            matrix[rows, :m] = equations.shared_pose[v].T
            matrix[rows, rows] = equations.pose[v]
        for rows in equations.rows():
            columns = m + 3 * np.arange((end - m) // 3)[rows.columns][:, None] + np.arange(3)
            poses = end + 6 * rows.view + np.arange(6)
            matrix[poses[:, None, None], columns] = rows.pose_corner().transpose(0, 2, 1)
        return np.tril(matrix) + np.tril(matrix, -1).T

    def gradient(self, equations: NormalEquations) -> np.ndarray:
        return np.concatenate([part.ravel() for part in equations.gradient])


def scaled_pinv(matrix: np.ndarray) -> np.ndarray:
    d = np.sqrt(np.diag(matrix))
    d[d == 0] = 1.0
    return np.linalg.pinv(matrix / np.outer(d, d), rcond=1e-12, hermitian=True) / np.outer(d, d)


def at_minimum(dense: Dense) -> NormalEquations:
    c, unknowns = dense.calibration, dense.unknowns
    table = CornerTable.of(c.observations.detections, c.options.weights)
    if len(unknowns.corners):
        table = table.keeping(np.isin(table.ids, unknowns.corners))
    estimate = Estimate.of(c)
    for _ in range(8):
        equations = linearise(c.camera.lens, table, estimate, unknowns)
        estimate = estimate.moved(unknowns, *factorise(equations).newton_step())
    return linearise(c.camera.lens, table, estimate, unknowns)


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
    assert np.abs((factorise(dense.equations).camera_covariance - expected) / np.outer(sigma, sigma)).max() < 1e-6


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
    ahead = whole.newton_step()
    sigma = np.sqrt(np.diag(whole.camera_covariance))
    found = camera_without_each_view(whole, ahead=ahead)
    assert np.abs(camera_without_each_view(whole, ahead=ahead, tolerance=1e-2) / sigma - found / sigma).max() < 1e-2
    for view in (0, 7):
        rest = np.arange(12) != view
        table = equations.table.keeping(rest[equations.table.view])
        table = replace(table, first=np.delete(table.first, view + 1))
        estimate = equations.estimate
        part = replace(estimate, rotations=estimate.rotations[rest], translations=estimate.translations[rest])
        step = factorise(linearise(equations.lens, table, part, equations.unknowns)).newton_step()
        expected = equations.unknowns.of_camera(step[0] - ahead[0])
        assert np.abs((found[view] - expected) / sigma).max() < 1e-5


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


def test_views_head_on_determine_nothing():
    camera = Camera("c", "pinhole", [1000.0, 1000.0, 500.0, 400.0], (1001, 801))
    poses = tuple(Pose(np.zeros(3), [x, -0.07, 1.0]) for x in (-0.2, -0.1, 0.0))
    calibration = Calibration(camera, observe(camera, BOARD, poses), poses, BOARD, "truth", SolveOptions())
    with pytest.raises(np.linalg.LinAlgError):
        factorise(normal_equations(calibration))


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


def test_whitening_inverts_the_covariance_and_fills_in_the_typical_one():
    covariance = np.array([[[4.0, 1.0], [1.0, 2.0]], [[0.0, 0.0], [0.0, 0.0]], [[9.0, 0.0], [0.0, 3.0]]])
    known = Detection(np.arange(3), np.zeros((3, 2)), covariance)
    unknown = Detection(np.arange(2), np.zeros((2, 2)))
    table = CornerTable.of((known, unknown), "covariance")
    information = table.whitening.transpose(0, 2, 1) @ table.whitening
    np.testing.assert_allclose(information[[0, 2]], np.linalg.inv(covariance[[0, 2]]), atol=1e-12)
    np.testing.assert_allclose(information[[1, 3, 4]], np.tile(np.eye(2) / 3.5, (3, 1, 1)), atol=1e-12)
    assert CornerTable.of((unknown,), "covariance").typical_weight == 1.0
    assert CornerTable.of((known,), "equal").whitening is None


def test_table_keeps_corners_with_their_views():
    views = [Detection(np.arange(n), np.full((n, 2), n)) for n in (5, 0, 3, 4000, 4000)]
    table = CornerTable.of(views)
    assert list(table.chunks()) == [(0, 4), (4, 5)]
    kept = table.keeping(table.ids != 1)
    np.testing.assert_array_equal(kept.counts, [4, 0, 2, 3999, 3999])
    np.testing.assert_array_equal(kept.pixels[:, 0], np.array([5, 0, 3, 4000, 4000])[kept.view])
    assert [len(part) for part in table.split(table.ids == 1)] == [5, 0, 3, 4000, 4000]
    np.testing.assert_array_equal(solvable_corners(table, 4001)[[0, -1]], [0, 3999])


def test_a_thinned_table_has_some_corners_of_every_view():
    table = CornerTable.of([Detection(np.arange(n), np.full((n, 2), n)) for n in (5, 0, 60, 4000)])
    thinned = table.thinned(1000)
    np.testing.assert_array_equal(thinned.counts[:3], [5, 0, 40])
    assert 900 < thinned.counts[3] < 1100
    assert set(thinned.pixels[thinned.view == 3, 0]) == {4000}
    np.testing.assert_array_equal(table.thinned(1000).ids, thinned.ids)
    assert table.thinned(5000) is table


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
