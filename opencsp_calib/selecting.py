"""Choosing views: the few of many that together tell most about the camera.

Time grows with the number of views, and errors that they share (the board's unevenness, the lens model) do not average
out. So a first camera is solved from a few views that differ most; with it, every view's information is known
(`opencsp_calib.information`), and views are taken one by one, each time the one that lowers the expected error of
projections over the image most. Of views from almost the same place, as a video has many, only one is taken while
there are others: it is their shared errors that do not average out.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from opencsp_calib.arrays import Floats, Mask
from opencsp_calib.calibration import LEAST_VIEWS, Calibration, Solve
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Detection, Observations, Problem
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.information import ProjectionGoal, view_information
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.pose_fit import fit_pose

__all__ = ["Selection", "select"]

FIRST_VIEWS = 30  # for the first camera: enough for any lens model, and quick
SAME_PLACE = 0.02  # of the image's width: corners that moved less on average are seen from the same place
MISFIT = 5.0  # times the median view's rms: such a view's information is a false one


@dataclass(frozen=True, eq=False)
class Selection:
    """The views chosen.

    Parameters
    ----------
    observations : Observations
        Of all images; the used views not chosen are dropped, with the reason.
    of : int
        How many views there were to choose from.
    loss : float
        Expected standard deviation of projections, over the one from all views, if all errors were independent.
    """

    observations: Observations = field(repr=False)
    of: int
    loss: float


def select(
    observations: Observations,
    count: int,
    solve: Solve,
    *,
    board_shape_known: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Selection:
    """The views that together tell most about a camera.

    Parameters
    ----------
    observations : Observations
    count : int
        How many of the used views to keep; where there are no more, all are.
    solve : callable
        Makes the first camera from a few views; a quick, rough one will do.
    board_shape_known : bool
        Whether the board's shape will not be solved for too, which takes views of its own.
    progress : callable, optional
        Called with the number of views judged, and their total.

    Raises
    ------
    InputError
        If fewer than `LEAST_VIEWS` are asked for.
    CalibrationFailedError
        If no first camera comes out.
    """
    if count < LEAST_VIEWS:
        raise InputError(f"cannot select {count} views: a calibration needs at least {LEAST_VIEWS}")
    used = observations.used
    if len(used) <= count:
        return Selection(observations, len(used), 1.0)
    places = _places(observations)
    first = solve(observations.keeping(used[index].image for index in _most_apart(places, FIRST_VIEWS)))
    poses = []
    for index, view in enumerate(used):
        poses.append(_pose(first, view.detection))
        if progress:
            progress(index + 1, len(used))
    fitting = _fitting(first.camera, observations, poses)
    posed = [(index, pose) for index, pose in enumerate(poses) if pose is not None and fitting[index]]
    informations, goal = _informations(first, observations, posed, board_shape_known)
    candidates = [index for index, _ in posed]
    chosen = _greedy(informations, goal, places[candidates], count, SAME_PLACE * observations.image_size[0])
    known = informations[chosen].sum(axis=0)
    loss = float(np.sqrt(goal.variance_px2(known) / goal.variance_px2(informations.sum(axis=0))))
    misfits = [view.image for view, fits in zip(used, fitting, strict=True) if not fits]
    names = [used[candidates[index]].image for index in chosen]
    left = observations.dropping(misfits, Problem("misfit", "does not fit the camera that the other views give"))
    others = [view.image for view in left.used if view.image not in set(names)]
    reason = f"is not among the {count} of {len(used)} views that together tell most"
    return Selection(left.dropping(others, Problem("not-selected", reason)), len(used), loss)


def _places(observations: Observations) -> Floats:
    """(V, K, 2) px where each used view has each of the board's corners; NaN where it has not."""
    places = np.full((len(observations.used), len(observations.board.points), 2), np.nan)
    for place, detection in zip(places, observations.detections, strict=True):
        place[detection.ids] = detection.pixels
    return places


def _distances(places: Floats, one: Floats) -> Floats:
    """(V,) px by how much corners moved on average between each view and one; infinite where they share none."""
    apart = np.linalg.norm(places - one, axis=2)
    shared = np.isfinite(apart)
    count = shared.sum(axis=1)
    total = np.where(shared, apart, 0.0).sum(axis=1)
    return np.where(count > 0, total / np.maximum(count, 1), np.inf)


def _most_apart(places: Floats, count: int) -> list[int]:
    """Views as far apart as can be, the one with the most corners first."""
    chosen = [int(np.isfinite(places[:, :, 0]).sum(axis=1).argmax())]
    nearest = _distances(places, places[chosen[0]])
    while len(chosen) < min(count, len(places)):
        nearest[chosen] = -1.0
        # views without a shared corner are infinitely far apart from all: they would be taken first, and fix nothing
        chosen.append(int(np.where(np.isinf(nearest), 0.0, nearest).argmax()))
        nearest = np.minimum(nearest, _distances(places, places[chosen[-1]]))
    return chosen


def _pose(first: Calibration, detection: Detection) -> Pose | None:
    try:
        return fit_pose(first.camera, first.board, detection)
    except (CalibrationFailedError, InputError):
        return None


def _fitting(camera: Camera, observations: Observations, poses: list[Pose | None]) -> Mask:
    """(V,) whether a view's corners are where its pose puts them, about as well as those of the others."""
    rms = np.full(len(poses), np.inf)
    for index, (pose, detection) in enumerate(zip(poses, observations.detections, strict=True)):
        if pose is not None:
            predicted = camera.project(pose.transform(observations.board.points[detection.ids]))
            rms[index] = np.sqrt(((predicted - detection.pixels) ** 2).sum(axis=1).mean())
    return np.asarray(rms <= MISFIT * np.median(rms))  # NaN, where the camera does not see a corner, is none


def _informations(
    first: Calibration,
    observations: Observations,
    posed: list[tuple[int, Pose]],
    board_shape_known: bool,
) -> tuple[Floats, ProjectionGoal]:
    detections = [observations.detections[index] for index, _ in posed]
    options = SolveOptions(
        board_shape="flat" if board_shape_known else "warp",
        pixel_aspect=first.options.pixel_aspect,
        weights=first.options.weights,
    )
    informations = view_information(first.camera, first.board, detections, [pose for _, pose in posed], options=options)
    return informations, ProjectionGoal.of(first.camera, first.board, options=options)


def _greedy(informations: Floats, goal: ProjectionGoal, places: Floats, count: int, same_px: float) -> list[int]:
    """One by one the view that is worth most; one from almost the same place as another only when no other is left."""
    chosen: list[int] = []
    known = np.zeros_like(goal.by_unknowns)
    left, apart = np.ones(len(informations), dtype=bool), np.ones(len(informations), dtype=bool)
    while len(chosen) < count and left.any():
        if not (left & apart).any():
            apart = np.ones_like(left)
        open_ = np.flatnonzero(left & apart)
        best = int(open_[goal.gains(known, informations[open_]).argmax()])
        chosen.append(best)
        known = known + informations[best]
        left[best] = False
        apart &= _distances(places, places[best]) > same_px
    return chosen
