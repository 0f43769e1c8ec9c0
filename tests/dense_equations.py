"""The unknowns of a small calibration as one long vector, with numerical derivatives and dense linear algebra."""

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from opencsp_calib.board import Checkerboard
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.detection import Detection, Observations
from opencsp_calib.normal_equations import NormalEquations, linearise, normal_equations
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.schur import factorise
from opencsp_calib.synthetic import bowed, demo_camera, observe, random_poses
from opencsp_calib.unknowns import Estimate

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
        matrix[m:end, :m] = equations.corner_shared.transpose(2, 0, 1).reshape(end - m, m)
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


def without_view(equations: NormalEquations, view: int) -> NormalEquations:
    """Those of all other views, linearised at the same place."""
    table, estimate = equations.table, equations.estimate
    rest = np.flatnonzero(np.arange(len(equations.pose)) != view)
    part = Estimate(estimate.params, estimate.rotations[rest], estimate.translations[rest], estimate.points)
    seen = [Detection(table.ids[s], table.pixels[s]) for v in rest for s in [table.span(v, v + 1)]]
    return linearise(equations.lens, CornerTable.of(seen), part, equations.unknowns)


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
