"""Residuals of a calibration, and how they change with everything that is solved for: the rows of the Jacobian J.

Corners come last in all arrays, so that one number of all of them lies side by side in memory: NumPy is several times
quicker that way than with a small matrix for each corner.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Points
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.models import LensModel
from opencsp_calib.unknowns import Estimate, Unknowns

__all__ = ["CORNER", "POSE", "ViewRows", "residuals", "row_count", "rows_of_each_view", "split_by_view"]

CORNER, POSE = 3, 6  # unknowns each


@dataclass(frozen=True, eq=False)
class ViewRows:
    """Rows of J of one view: how its whitened residuals change with what it involves, and the residuals themselves.

    Parameters
    ----------
    view : int
    columns : (n,) int, or slice
        Where its corners are among those solved for; a slice where it sees all of them in order.
    values : (2, 3 + M + 7, n)
        By [corner | shared], the residual, by [pose]. Where no corner is solved for, the first three are not there.
    """

    view: int
    columns: Ids | slice
    values: Floats

    @property
    def corner(self) -> Floats:
        """(2, 3, n)."""
        return self.values[:, :CORNER]

    @property
    def shared(self) -> Floats:
        """(2, M, n)."""
        return self.values[:, CORNER : -1 - POSE]

    @property
    def residual(self) -> Floats:
        """(2, n)."""
        return self.values[:, -1 - POSE]

    @property
    def pose(self) -> Floats:
        """(2, 6, n)."""
        return self.values[:, -POSE:]

    def pose_corner(self) -> Floats:
        """(6, 3, n) products of the pose with each corner's shift: the blocks of JᵀJ that tie the two."""
        return np.asarray(np.einsum("apn,ain->pin", self.pose, self.corner))


def residuals(lens: LensModel, table: CornerTable, estimate: Estimate) -> Floats:
    """(N, 2) px predicted minus detected, not whitened; NaN where a corner has no image."""
    found = np.empty((len(table), 2))
    for views in table.chunks():
        span = table.span(*views)
        points = _turned(table, estimate, views) + _shifts(table, estimate, views)
        found[span] = lens.project(points.T, estimate.params) - table.pixels_of(*views)
    return found


def rows_of_each_view(
    lens: LensModel,
    table: CornerTable,
    estimate: Estimate,
    unknowns: Unknowns,
    views: tuple[int, int],
    room: Floats | None = None,
) -> Iterator[ViewRows]:
    """The rows of a run of views, the first to before the last.

    Parameters
    ----------
    lens : LensModel
    table : CornerTable
    estimate : Estimate
    unknowns : Unknowns
    views : (int, int)
    room : (2, 3 + M + 7, n), optional
        Where to leave the rows of all of them. Without it, those of a view are gone when the next ones are made:
        fresh memory costs as much as what is computed in it.
    """
    runs = list(table.chunks(*views))
    longest = max((table.span(*run).stop - table.span(*run).start for run in runs), default=0)
    used_again = room is None
    room = np.empty((2, row_count(unknowns), longest)) if room is None else room
    for run in runs:
        values = room[:, :, table.span(*run, since=run[0] if used_again else views[0])]
        _fill(values, lens, table, estimate, unknowns, run)
        yield from split_by_view(table, unknowns, run, values)


def row_count(unknowns: Unknowns) -> int:
    """What residuals of one view change with, and the residual: 3 + M + 7, or M + 7 where no corner is solved for."""
    return (CORNER if len(unknowns.corners) else 0) + unknowns.shared + 1 + POSE


def _fill(
    values: Floats,
    lens: LensModel,
    table: CornerTable,
    estimate: Estimate,
    unknowns: Unknowns,
    views: tuple[int, int],
) -> None:
    """Of a run of views, all at once."""
    cameras, shared = unknowns.camera.shape[1], unknowns.shared
    skipped = CORNER if len(unknowns.corners) else 0
    turned = _turned(table, estimate, views)
    points = turned + _shifts(table, estimate, views)
    pixels, by_point, by_params = lens.project_with_jacobians(points.T, estimate.params)
    whitening = table.whitening(*views)
    rows = values[:, skipped:]
    by_shift = rows[:, -CORNER:]
    _whiten(whitening, by_point.transpose(1, 2, 0), by_shift)
    _whiten(whitening, _by_camera(by_params.transpose(1, 2, 0), unknowns), rows[:, :cameras])
    _whiten(whitening, (pixels - table.pixels_of(*views)).T, rows[:, shared])
    for axis, (one, two) in enumerate(((1, 2), (2, 0), (0, 1))):
        rows[:, shared + 1 + axis] = turned[one] * by_shift[:, two] - turned[two] * by_shift[:, one]
    if skipped or shared > cameras:
        by_board = np.empty_like(by_shift)
        for view in range(*views):
            here = table.span(view, view + 1, since=views[0])
            by_board[:, :, here] = estimate.rotations[view].T @ by_shift[:, :, here]
        values[:, :skipped] = by_board[:, :skipped]
        rows[:, cameras:shared] = np.einsum("ain,niw->awn", by_board, unknowns.warp[table.ids_of(*views)])


def split_by_view(table: CornerTable, unknowns: Unknowns, views: tuple[int, int], values: Floats) -> Iterator[ViewRows]:
    """The rows of a run of views (2, 3 + M + 7, n), one view after the other."""
    first = (table.first[views[0] : views[1] + 1] - table.first[views[0]]).tolist()
    for view, begin, end in zip(range(*views), first, first[1:], strict=False):
        yield ViewRows(view, _columns(table.detections[view].ids, unknowns.corners), values[:, :, begin:end])


def _columns(ids: Ids, corners: Ids) -> Ids | slice:
    """Where corners are among those solved for."""
    if len(ids) == len(corners) and (ids == corners).all():
        return slice(None)
    return np.searchsorted(corners, ids)


def _by_camera(by_params: Floats, unknowns: Unknowns) -> Floats:
    """(2, Q, n) by the camera's unknowns, from (2, P, n) by its parameters: mostly the same."""
    same = np.array_equal(unknowns.camera, np.eye(by_params.shape[1]))
    return by_params if same else unknowns.camera.T @ by_params


def _whiten(whitening: Floats | None, rows: Floats, out: Floats) -> None:
    """Rows (2, ..., n) multiplied by lower triangular matrices (2, 2, n), put where they belong."""
    if whitening is None:
        out[:] = rows
        return
    (a, _), (b, c) = whitening
    np.multiply(a, rows[0], out=out[0])
    np.multiply(b, rows[0], out=out[1])
    out[1] += c * rows[1]


def _turned(table: CornerTable, estimate: Estimate, views: tuple[int, int]) -> Points:
    """(3, n) m: a run of views' corners, turned as the camera sees them but not yet shifted."""
    points = estimate.points.T
    turned = [estimate.rotations[view] @ points[:, table.detections[view].ids] for view in range(*views)]
    return np.concatenate(turned, axis=1)


def _shifts(table: CornerTable, estimate: Estimate, views: tuple[int, int]) -> Floats:
    """(3, n) m."""
    run = slice(*views)
    return np.repeat(estimate.translations[run].T, table.counts[run], axis=1)
