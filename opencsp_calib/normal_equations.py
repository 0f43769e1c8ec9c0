"""The normal equations of a calibration, in blocks: what the solver `bundle` iterates and uncertainty is read from.

The unknowns of a calibration are few that all views share (the camera's parameters, maybe a smooth warp of the
board), three for every corner of the board where its shape is free, and six for every view's pose. A corner seen in a
view involves only its own, so the normal matrix JᵀJ is made of small blocks, and `opencsp_calib.schur` takes them
apart. With V views, C corners solved for, and M shared unknowns (Q of the camera, then W of the warp)::

    shared   (V, M, M)      shared_pose   (V, M, 6)      shared_gradient   (V, M)
    pose     (V, 6, 6)      corner_shared (V, C, 3, M)   pose_gradient     (V, 6)
    corner   (V, C, 3, 3)   corner_pose   (V, C, 3, 6)   corner_gradient   (V, C, 3)

Every block is of one view; summed over the first axis they are the normal equations of the whole. Blocks of a corner
that a view does not see are zero. A pose's unknowns are a small rotation (rad) applied after its rotation, about the
board's origin, then a shift (m) in the camera's frame; a corner's are its shift (m) in the board's frame.
"""

from dataclasses import dataclass, replace

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Points
from opencsp_calib.calibration import Calibration
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.models import LensModel
from opencsp_calib.unknowns import Estimate, Unknowns

__all__ = [
    "NormalEquations",
    "linearise",
    "normal_equations",
    "residuals",
    "solvable_corners",
    "well_conditioned",
]

CORNER, POSE = 3, 6  # unknowns each
TOLD_APART = 1e-8  # smallest eigenvalue of the camera's scaled information, poses held, that leaves enough digits
ROUNDING = 1e-15  # below this an eigenvalue is made of it


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Blocks of JᵀJ and gradients Jᵀr of each view; the module's docstring has the shapes.

    Parameters
    ----------
    unknowns : Unknowns
    dense : (V, M + 7, M + 7)
        Products of [shared | pose | residual] with themselves.
    by_corner : (V, C, 3, M + 10)
        Products of each corner's shift with [corner | shared | pose | residual].
    corner_gauge, pose_gauge : (C, 3, 7), (V, 6, 7)
        The steps that change no projection: three shifts and three turns of the board, and its scale with that of the
        distances. All zero where no corner is solved for.
    numbers : int
        Of residuals, two a corner.
    """

    unknowns: Unknowns
    dense: Floats
    by_corner: Floats
    corner_gauge: Floats
    pose_gauge: Floats
    numbers: int

    @property
    def cost(self) -> float:
        """Sum of squared whitened residuals; NaN where a corner has no image."""
        return float(self.dense[:, -1, -1].sum())

    @property
    def dof(self) -> int:
        """Numbers observed minus unknowns: what the cost is divided by to give the variance s²."""
        corners = len(self.unknowns.corners)
        solved = self.unknowns.shared + POSE * len(self.dense) + 3 * corners - (7 if corners else 0)
        return self.numbers - solved

    @property
    def shared(self) -> Floats:
        """(V, M, M)."""
        return self.dense[:, : -1 - POSE, : -1 - POSE]

    @property
    def shared_pose(self) -> Floats:
        """(V, M, 6)."""
        return self.dense[:, : -1 - POSE, -1 - POSE : -1]

    @property
    def pose(self) -> Floats:
        """(V, 6, 6)."""
        return self.dense[:, -1 - POSE : -1, -1 - POSE : -1]

    @property
    def shared_gradient(self) -> Floats:
        """(V, M)."""
        return self.dense[:, : -1 - POSE, -1]

    @property
    def pose_gradient(self) -> Floats:
        """(V, 6)."""
        return self.dense[:, -1 - POSE : -1, -1]

    @property
    def corner(self) -> Floats:
        """(V, C, 3, 3)."""
        return self.by_corner[..., :CORNER]

    @property
    def corner_shared(self) -> Floats:
        """(V, C, 3, M)."""
        return self.by_corner[..., CORNER : -1 - POSE]

    @property
    def corner_pose(self) -> Floats:
        """(V, C, 3, 6)."""
        return self.by_corner[..., -1 - POSE : -1]

    @property
    def corner_gradient(self) -> Floats:
        """(V, C, 3)."""
        return self.by_corner[..., -1]


def normal_equations(calibration: Calibration) -> NormalEquations:
    """The normal equations of any solver's calibration, at its solution, without its outliers.

    What was solved for and how corners were weighted is taken from its options. Where the board's shape is free,
    corners seen in one view only tell nothing about the camera and are left out.
    """
    detections = [
        detection.keeping(~outliers)
        for detection, outliers in zip(calibration.observations.detections, calibration.outliers, strict=True)
    ]
    table = CornerTable.of(detections, calibration.options.weights)
    corners = solvable_corners(table, len(calibration.board.points))
    camera = calibration.camera
    unknowns = Unknowns.of(camera.lens, calibration.observations.board, corners, calibration.options)
    if len(unknowns.corners):
        table = table.keeping(np.isin(table.ids, corners))
    estimate = Estimate.of(calibration)
    equations = linearise(camera.lens, table, estimate, unknowns)
    conditioned = well_conditioned(equations)
    return equations if conditioned is unknowns else linearise(camera.lens, table, estimate, conditioned)


def well_conditioned(equations: NormalEquations) -> Unknowns:
    """The same unknowns, the camera's replaced by combinations of them that images tell apart.

    The coefficients of a rational model can be traded for one another almost without a trace. In the products of
    their derivatives what is left of one after the others drowns in rounding; combined before they are multiplied,
    it is known to half the digits. Given back as they are where there is no need.
    """
    unknowns = equations.unknowns
    cameras = unknowns.camera.shape[1]
    information = equations.shared.sum(axis=0)[:cameras, :cameras]
    scale = 1.0 / np.sqrt(np.diag(information))
    if not np.isfinite(scale).all():
        return unknowns
    sizes, directions = np.linalg.eigh(information * scale[:, None] * scale)
    if sizes[0] > TOLD_APART:
        return unknowns
    combined = scale[:, None] * directions / np.sqrt(np.maximum(sizes, ROUNDING))
    return replace(unknowns, camera=unknowns.camera @ combined)


def solvable_corners(table: CornerTable, count: int) -> Ids:
    """Ids of the corners, of `count`, that are seen in at least two views: one view leaves the distance open."""
    return np.flatnonzero(np.bincount(table.ids, minlength=count) >= 2)


def residuals(lens: LensModel, table: CornerTable, estimate: Estimate) -> Floats:
    """(N, 2) px predicted minus detected, not whitened; NaN where a corner has no image."""
    predicted = [
        lens.project(_turned(table, estimate, begin, end) + _shifts(table, estimate, begin, end), estimate.params)
        for begin, end in table.chunks()
    ]
    return np.concatenate([*predicted, np.empty((0, 2))]) - table.pixels


def linearise(lens: LensModel, table: CornerTable, estimate: Estimate, unknowns: Unknowns) -> NormalEquations:
    """The normal equations at an estimate; blocks are NaN where a corner has no image."""
    views, shared, corners = len(table.first) - 1, unknowns.shared, len(unknowns.corners)
    dense = np.empty((views, shared + POSE + 1, shared + POSE + 1))
    by_corner = np.zeros((views, corners, CORNER, CORNER + shared + POSE + 1))
    column = np.empty(len(estimate.points), dtype=np.int64)
    column[unknowns.corners] = np.arange(corners)
    skipped = CORNER if corners else 0
    for begin, end in table.chunks():
        rows = _rows(lens, table, estimate, unknowns, (begin, end))
        first = table.first[begin : end + 1] - table.first[begin]
        for view, low, high in zip(range(begin, end), first[:-1], first[1:], strict=True):
            block = rows[low:high].reshape(-1, rows.shape[2])
            dense[view] = (block.T @ block)[skipped:, skipped:]
            if corners:
                columns = column[table.ids[_span(table, view)]]
                by_corner[view, columns] = rows[low:high, :, :CORNER].transpose(0, 2, 1) @ rows[low:high]
    return NormalEquations(unknowns, dense, by_corner, *_gauge(estimate, unknowns), numbers=2 * len(table))


def _rows(
    lens: LensModel, table: CornerTable, estimate: Estimate, unknowns: Unknowns, views: tuple[int, int]
) -> Floats:
    """Of a run of views, whitened, (n, 2, ...): [shared | pose | residual], and before them [corner] if solved for."""
    begin, end = views
    span = slice(table.first[begin], table.first[end])
    turned = _turned(table, estimate, begin, end)
    pixels, by_point, by_params = lens.project_with_jacobians(
        turned + _shifts(table, estimate, begin, end), estimate.params
    )
    cameras, shared = unknowns.camera.shape[1], unknowns.shared
    skipped = CORNER if len(unknowns.corners) else 0
    all_rows = np.empty((len(pixels), 2, skipped + shared + POSE + 1))
    rows = all_rows[:, :, skipped:]
    rows[:, :, :cameras] = (by_params.reshape(-1, len(unknowns.camera)) @ unknowns.camera).reshape(-1, 2, cameras)
    a, j = turned[:, None, :], by_point
    for axis, (one, two) in enumerate(((1, 2), (2, 0), (0, 1))):
        rows[:, :, shared + axis] = a[:, :, one] * j[:, :, two] - a[:, :, two] * j[:, :, one]
    rows[:, :, shared + 3 : shared + POSE] = by_point
    rows[:, :, -1] = pixels - table.pixels[span]
    if skipped or shared > cameras:
        by_board = by_point @ np.repeat(estimate.rotations[begin:end], table.counts[begin:end], axis=0)
        all_rows[:, :, :skipped] = by_board[:, :, :skipped]
        rows[:, :, cameras:shared] = by_board @ unknowns.warp[table.ids[span]]
    return all_rows if table.whitening is None else table.whitening[span] @ all_rows


def _gauge(estimate: Estimate, unknowns: Unknowns) -> tuple[Floats, Floats]:
    """See `NormalEquations.corner_gauge`.

    Moving the board's points by ``p -> (1 + s) p + w x p + d`` and the poses by a turn of ``-R w`` and a shift of
    ``s t - R d`` scales all points in the camera's frame by 1 + s, which no image shows.
    """
    corner_gauge = np.zeros((len(unknowns.corners), 3, 7))
    pose_gauge = np.zeros((len(estimate.rotations), POSE, 7))
    if len(unknowns.corners):
        points = estimate.points[unknowns.corners]
        corner_gauge[:, :, :3] = np.eye(3)
        corner_gauge[:, :, 3:6] = np.cross(np.eye(3)[None], points[:, None, :]).transpose(0, 2, 1)
        corner_gauge[:, :, 6] = points
        pose_gauge[:, 3:, :3] = -estimate.rotations
        pose_gauge[:, :3, 3:6] = -estimate.rotations
        pose_gauge[:, 3:, 6] = estimate.translations
    return corner_gauge, pose_gauge


def _span(table: CornerTable, view: int) -> slice:
    return slice(table.first[view], table.first[view + 1])


def _turned(table: CornerTable, estimate: Estimate, begin: int, end: int) -> Points:
    """(n, 3) m: a run of views' corners, turned as the camera sees them but not yet shifted."""
    turned = [estimate.points[table.ids[_span(table, view)]] @ estimate.rotations[view].T for view in range(begin, end)]
    return np.concatenate(turned)


def _shifts(table: CornerTable, estimate: Estimate, begin: int, end: int) -> Floats:
    return np.repeat(estimate.translations[begin:end], table.counts[begin:end], axis=0)
