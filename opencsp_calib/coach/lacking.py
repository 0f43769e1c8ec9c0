"""What a set of views still needs by the seed's procedure, in words, and which further view would help."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from opencsp_calib.arrays import Pixels
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.counted import counted
from opencsp_calib.detection import Observations
from opencsp_calib.judgement import FEW_VIEWS, RANGE_SPREAD
from opencsp_calib.pose import Pose
from opencsp_calib.quality import held, range_of

__all__ = ["REGIONS", "TILT_ALLOWED_DEG", "Lack", "lacks"]

TILT_ALLOWED_DEG = (25.0, 50.0)  # 30 to 45 are asked for; a person does not hold a board to a degree
REACH = 0.2  # of the image's width and height: corners of the board this near to an edge reach it
LEAST_OF_EACH = 0.3  # of the views, held each way; the procedure asks for half
NEAR_FAR = 1.15  # times the middle range: a view this much nearer or farther spreads them

REGIONS = {
    (column, row): " ".join(name for name in (vertical, horizontal) if name) or "middle"
    for row, vertical in enumerate(("upper", "", "lower"))
    for column, horizontal in enumerate(("left", "", "right"))
}
"""Names of the image's nine regions, by column and row."""


@dataclass(frozen=True)
class Lack:
    """Something that the set still needs.

    Parameters
    ----------
    code : str
        Short, stable: ``views``, ``tilt``, ``orientation``, ``coverage``, ``range``.
    message : str
        For the person who holds the board.
    helped_by : callable
        Whether a view of the board in a pose would help: takes camera, board, pose. It can be sent to another process.
    """

    code: str
    message: str
    helped_by: Callable[[Camera, Board, Pose], bool] = field(repr=False, compare=False)


def lacks(observations: Observations, poses: Sequence[Pose]) -> tuple[Lack, ...]:
    """What views, with the poses of the board in them, still lack."""
    board = observations.board
    found = [
        _views(len(poses)),
        _tilt(poses),
        _orientation(board, poses),
        _coverage(observations),
        _range(board, poses),
    ]
    return tuple(lack for lack in found if lack is not None)


def _views(count: int) -> Lack | None:
    if count >= FEW_VIEWS:
        return None
    return Lack("views", f"{counted(FEW_VIEWS - count, 'more view')} at least", _no_view_by_itself)


def _tilt(poses: Sequence[Pose]) -> Lack | None:
    good = sum(map(_is_tilted_well, poses))
    if poses and good >= len(poses) / 2:
        return None
    so_far = f": {good} of {counted(len(poses), 'view')} so far" if poses else ""
    return Lack("tilt", f"tilt the board by 30 to 45 degrees{so_far}", _tilts)


def _orientation(board: Board, poses: Sequence[Pose]) -> Lack | None:
    ways = [held(board, pose) for pose in poses]
    counts = {way: ways.count(way) for way in ("horizontal", "vertical")}
    rarer = min(counts, key=lambda way: counts[way])
    if poses and counts[rarer] >= LEAST_OF_EACH * len(poses):
        return None
    horizontal = counted(counts["horizontal"], "view is", "views are")
    message = f"hold the board {rarer}: {horizontal} horizontal, {counts['vertical']} vertical"
    if not poses:
        message = "half of the views with the board horizontal, half vertical"
    return Lack("orientation", message, partial(_holds, rarer))


def _coverage(observations: Observations) -> Lack | None:
    reached: set[tuple[int, int]] = set()
    for detection in observations.detections:
        reached |= _reached(detection.pixels, observations.image_size)
    missing = [where for where in REGIONS if where not in reached]
    if not missing:
        return None
    names = ", ".join(REGIONS[where] for where in missing) if reached else "all of it"
    message = f"bring the board to the parts of the image where none was: {names}"
    return Lack("coverage", message, partial(_reaches, missing))


def _reached(pixels: Pixels, image_size: tuple[int, int]) -> set[tuple[int, int]]:
    """The regions that corners lie in: the four ends of the image, a strip along each edge, and the middle."""
    inside = pixels[np.isfinite(pixels).all(axis=1)]
    places = np.digitize(inside / np.array(image_size), [REACH, 1.0 - REACH])
    return {(int(column), int(row)) for column, row in np.unique(places, axis=0)}


def _range(board: Board, poses: Sequence[Pose]) -> Lack | None:
    ranges = [range_of(board, pose) for pose in poses]
    if ranges and max(ranges) > RANGE_SPREAD * min(ranges):
        return None
    message = f"go nearer or farther: all views are {min(ranges):.2f} m away" if ranges else "views from two distances"
    middle = float(np.median(ranges)) if ranges else float("nan")
    return Lack("range", message, partial(_is_elsewhere, middle))


def _no_view_by_itself(_: Camera, __: Board, ___: Pose) -> bool:
    return False


def _is_tilted_well(pose: Pose) -> bool:
    low, high = TILT_ALLOWED_DEG
    return low <= pose.tilt_deg <= high


def _tilts(_: Camera, __: Board, pose: Pose) -> bool:
    return _is_tilted_well(pose)


def _holds(way: str, _: Camera, board: Board, pose: Pose) -> bool:
    return held(board, pose) == way


def _reaches(regions: Sequence[tuple[int, int]], camera: Camera, board: Board, pose: Pose) -> bool:
    pixels = camera.project(pose.transform(board.points))
    return not _reached(pixels, camera.image_size).isdisjoint(regions)


def _is_elsewhere(middle_m: float, _: Camera, board: Board, pose: Pose) -> bool:
    ratio = range_of(board, pose) / middle_m
    return not 1 / NEAR_FAR < ratio < NEAR_FAR
