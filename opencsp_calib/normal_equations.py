"""The normal equations of a calibration, in blocks: what the solver `bundle` iterates and uncertainty is read from.

The unknowns of a calibration are few that all views share (the camera's parameters, maybe a smooth warp of the
board), three for every corner of the board where its shape is free, and six for every view's pose. A corner seen in a
view involves only its own, so the normal matrix JᵀJ is made of small blocks, and `opencsp_calib.schur` takes them
apart. With V views, C corners solved for, and M shared unknowns (Q of the camera, then W of the warp)::

    shared   (V, M, M)      shared_pose   (V, M, 6)      shared_gradient   (V, M)
    pose     (V, 6, 6)                                   pose_gradient     (V, 6)
    corner   (C, 3, 3)      corner_shared (3, M, C)      corner_gradient   (C, 3)

Blocks with a V are of one view; summed over it they are those of the whole, as the others are. What ties each corner
to each pose is not kept, since it would take several times the memory of the corners themselves: `NormalEquations.rows`
has the rows of J it is made of, view after view. A pose's unknowns are a small rotation (rad) applied after its
rotation, about the board's origin, then a shift (m) in the camera's frame; a corner's are its shift (m) in the board's
frame.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from opencsp_calib.arrays import Floats, Ids
from opencsp_calib.calibration import Calibration
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.jacobian import CORNER, POSE, ViewRows, row_count, rows_of_each_view, split_by_view
from opencsp_calib.models import LensModel
from opencsp_calib.unknowns import Estimate, Unknowns

__all__ = [
    "NormalEquations",
    "Parts",
    "linearise",
    "normal_equations",
    "solvable_corners",
    "well_conditioned",
]

TOLD_APART = 1e-8  # smallest eigenvalue of the camera's scaled information, poses held, that leaves enough digits
ROUNDING = 1e-15  # below this an eigenvalue is made of it
KEPT = 81920  # corners: of so many, rows of J are kept (25 MB); of more, they are made again when they are needed

Parts: TypeAlias = tuple[Floats, Floats, Floats]
"""A number for every unknown: (M,) of the shared ones, (C, 3) of the corners, (V, 6) of the poses."""


@dataclass(frozen=True, eq=False)
class NormalEquations:
    """Blocks of JᵀJ and gradients Jᵀr; the module's docstring has the shapes.

    Parameters
    ----------
    lens : LensModel
    table : CornerTable
    estimate : Estimate
        Where they were linearised.
    unknowns : Unknowns
    dense : (V, M + 7, M + 7)
        Products of [shared | residual | pose] with themselves.
    by_corner : (3, M + 4, C)
        Products of each corner's shift with [corner | shared | residual].
    kept_rows : (2, 3 + M + 7, N), optional
        Rows of J; None where they are to be made again.
    """

    lens: LensModel
    table: CornerTable
    estimate: Estimate
    unknowns: Unknowns
    dense: Floats
    by_corner: Floats
    kept_rows: Floats | None

    @property
    def cost(self) -> float:
        """Sum of squared whitened residuals; NaN where a corner has no image."""
        return float(self.dense[:, -1 - POSE, -1 - POSE].sum())

    @property
    def numbers(self) -> int:
        """Of residuals, two a corner."""
        return 2 * len(self.table)

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
        return self.dense[:, : -1 - POSE, -POSE:]

    @property
    def pose(self) -> Floats:
        """(V, 6, 6)."""
        return self.dense[:, -POSE:, -POSE:]

    @property
    def shared_gradient(self) -> Floats:
        """(V, M)."""
        return self.dense[:, : -1 - POSE, -1 - POSE]

    @property
    def pose_gradient(self) -> Floats:
        """(V, 6)."""
        return self.dense[:, -POSE:, -1 - POSE]

    @property
    def corner(self) -> Floats:
        """(C, 3, 3)."""
        return np.asarray(self.by_corner[:, :CORNER].transpose(2, 0, 1))

    @property
    def corner_shared(self) -> Floats:
        """(3, M, C), as it lies in memory."""
        return self.by_corner[:, CORNER:-1]

    @property
    def corner_gradient(self) -> Floats:
        """(C, 3)."""
        return np.asarray(self.by_corner[:, -1].T)

    @property
    def gradient(self) -> Parts:
        """By all unknowns."""
        return self.shared_gradient.sum(axis=0), self.corner_gradient, self.pose_gradient

    def rows(self, begin: int = 0, end: int | None = None, *, together: bool = False) -> Iterator[ViewRows]:
        """Rows of J of the views from `begin` to before `end`; none where no corner is solved for.

        Those of a view may be gone when the next ones are made, unless they are wanted `together`.
        """
        end = len(self.dense) if end is None else end
        if not len(self.unknowns.corners):
            return
        if self.kept_rows is not None:
            values = self.kept_rows[:, :, self.table.span(begin, end)]
            yield from split_by_view(self.table, self.unknowns, (begin, end), values)
            return
        room = _room(self.unknowns, self.table.counts[begin:end].sum()) if together else None
        yield from rows_of_each_view(self.lens, self.table, self.estimate, self.unknowns, (begin, end), room)

    def keeping(self, views: slice) -> "NormalEquations":
        """Those of some of the views alone, linearised at the same place.

        Where the board's shape is free, without corners that fewer than two of these views see.

        Parameters
        ----------
        views : slice
            In the order they are in.
        """
        of_views = self.table.in_views(views)
        table, estimate, unknowns = self.table.of_views(views), self.estimate.of_views(views), self.unknowns
        if not len(unknowns.corners):
            return replace(self, table=table, estimate=estimate, dense=self.dense[views])
        seen = solvable_corners(table, len(estimate.points))
        if self.kept_rows is None or len(seen) < len(unknowns.corners):
            fewer = replace(unknowns, corners=seen)
            return linearise(self.lens, table.keeping(np.isin(table.ids, seen)), estimate, fewer)
        kept, by_corner = self.kept_rows.compress(of_views, axis=2), np.zeros_like(self.by_corner)
        for rows in split_by_view(table, unknowns, (0, len(table.counts)), kept):
            _add_by_corner(by_corner, rows)
        return NormalEquations(self.lens, table, estimate, unknowns, self.dense[views], by_corner, kept)

    def gauge(self) -> tuple[Floats, Floats]:
        """The steps that change no projection, (C, 3, 7) and (V, 6, 7); all zero where no corner is solved for.

        Three shifts and three turns of the board, and its scale with that of the distances. Moving the board's points
        by ``p -> (1 + s) p + w x p + d`` and the poses by a turn of ``-R w`` and a shift of ``s t - R d`` scales all
        points in the camera's frame by 1 + s, which no image shows.
        """
        corner_gauge = np.zeros((len(self.unknowns.corners), 3, 7))
        pose_gauge = np.zeros((len(self.dense), POSE, 7))
        if len(self.unknowns.corners):
            points = self.estimate.points[self.unknowns.corners]
            corner_gauge[:, :, :3] = np.eye(3)
            corner_gauge[:, :, 3:6] = np.cross(np.eye(3)[None], points[:, None, :]).transpose(0, 2, 1)
            corner_gauge[:, :, 6] = points
            pose_gauge[:, 3:, :3] = -self.estimate.rotations
            pose_gauge[:, :3, 3:6] = -self.estimate.rotations
            pose_gauge[:, 3:, 6] = self.estimate.translations
        return corner_gauge, pose_gauge


def normal_equations(calibration: Calibration, table: CornerTable | None = None) -> NormalEquations:
    """The normal equations of any solver's calibration, at its solution, without its outliers.

    What was solved for and how corners were weighted is taken from its options. Where the board's shape is free,
    corners seen in one view only tell nothing about the camera and are left out. The table of all corners, weighted
    so, can be given where it is there already.
    """
    table = table or _table(calibration)
    corners = solvable_corners(table, len(calibration.board.points))
    camera = calibration.camera
    unknowns = Unknowns.of(camera.lens, calibration.observations.board, corners, calibration.options)
    if len(unknowns.corners):
        table = table.keeping(np.isin(table.ids, corners))
    estimate = Estimate.of(calibration)
    equations = linearise(camera.lens, table, estimate, unknowns)
    conditioned = well_conditioned(equations)
    return equations if conditioned is unknowns else linearise(camera.lens, table, estimate, conditioned)


def _table(calibration: Calibration) -> CornerTable:
    seen = zip(calibration.observations.detections, calibration.outliers, strict=True)
    detections = [detection.keeping(~outliers) if outliers.any() else detection for detection, outliers in seen]
    return CornerTable.of(detections, calibration.options.weights)


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


def linearise(lens: LensModel, table: CornerTable, estimate: Estimate, unknowns: Unknowns) -> NormalEquations:
    """The normal equations at an estimate; blocks are NaN where a corner has no image."""
    shared, corners = unknowns.shared, len(unknowns.corners)
    dense = np.empty((len(table.first) - 1, shared + 1 + POSE, shared + 1 + POSE))
    by_corner = np.zeros((CORNER, CORNER + shared + 1, corners))
    kept = _room(unknowns, len(table)) if corners and len(table) <= KEPT else None
    for rows in rows_of_each_view(lens, table, estimate, unknowns, (0, len(dense)), kept):
        first, second = rows.values[:, CORNER if corners else 0 :]
        dense[rows.view] = first @ first.T + second @ second.T
        if corners:
            _add_by_corner(by_corner, rows)
    return NormalEquations(lens, table, estimate, unknowns, dense, by_corner, kept)


def _room(unknowns: Unknowns, corners: int) -> Floats:
    """Where rows of J go, not yet filled."""
    return np.empty((2, row_count(unknowns), corners))


def _add_by_corner(by_corner: Floats, rows: ViewRows) -> None:
    by_corner[:, :, rows.columns] += np.einsum("ain,ajn->ijn", rows.corner, rows.values[:, :-POSE])
