"""What shape a board really has: how far out of flat, and how its grid differs from a square one.

A calibration knows a board's shape but not its size, place or direction, so the board as solved is first brought to
the nominal one by the similarity that fits best.
"""

from dataclasses import dataclass, field

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Points, frozen, frozen_ids
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.detection import Problem
from opencsp_calib.errors import InputError
from opencsp_calib.free_board import turn_between
from opencsp_calib.normal_equations import solvable_corners

__all__ = ["FLATNESS_LIMIT_M", "Flatness", "aligned", "flatness", "flatness_of_solved", "not_flat"]

FLATNESS_LIMIT_M = 0.5e-3
"""The seed's: a board that is farther out of flat, peak to valley, is not fit for use as a flat one."""


@dataclass(frozen=True, eq=False)
class Flatness:
    """How a board's corners lie against a flat, square grid.

    Parameters
    ----------
    ids : (n,) int
        The corners looked at.
    heights_m : (n,) m
        Out of the plane that fits best; positive along the board's z, which is away from a camera that faces it.
    in_plane_m : (n, 2) m
        Along columns and rows, what is left after the best similarity to the nominal grid: pitch and shear are in it.
    pitch_ratio : float
        The spacing along y over that along x.
    shear_rad : float
        By how much the angle between columns and rows is less than a right one.
    """

    ids: Ids = field(repr=False)
    heights_m: Floats = field(repr=False)
    in_plane_m: Floats = field(repr=False)
    pitch_ratio: float
    shear_rad: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "ids", frozen_ids(self.ids, "corner ids", (None,)))
        n = len(self.ids)
        object.__setattr__(self, "heights_m", frozen(self.heights_m, "heights", (n,)))
        object.__setattr__(self, "in_plane_m", frozen(self.in_plane_m, "deviations in plane", (n, 2)))

    @property
    def peak_to_valley_m(self) -> float:
        """From the lowest to the highest corner."""
        return float(np.ptp(self.heights_m))


def flatness(board: Board, ids: Ids | None = None) -> Flatness:
    """How a board lies against the nominal one.

    Parameters
    ----------
    board : Board
        As measured or as solved.
    ids : (n,) int, optional
        Only these corners; by default all.

    Raises
    ------
    InputError
        If there are fewer than four corners, or all are on one line.
    """
    chosen = np.arange(len(board.points), dtype=np.int64) if ids is None else ids
    nominal = board.nominal_points[chosen]
    if len(nominal) < 4 or np.linalg.matrix_rank(nominal[:, :2] - nominal[:, :2].mean(axis=0)) < 2:
        raise InputError("four corners, not all on one line, are the least to tell a board's shape")
    points = aligned(board.points[chosen], nominal)
    flat = np.column_stack([nominal[:, :2], np.ones(len(nominal))])
    heights = points[:, 2] - flat @ np.linalg.lstsq(flat, points[:, 2], rcond=None)[0]
    (x_by_x, y_by_x), (x_by_y, y_by_y) = np.linalg.lstsq(flat, points[:, :2], rcond=None)[0][:2]
    pitch_x, pitch_y = np.hypot(x_by_x, y_by_x), np.hypot(x_by_y, y_by_y)
    shear = np.arcsin((x_by_x * x_by_y + y_by_x * y_by_y) / (pitch_x * pitch_y))
    return Flatness(chosen, heights, points[:, :2] - nominal[:, :2], float(pitch_y / pitch_x), float(shear))


def flatness_of_solved(calibration: Calibration) -> Flatness:
    """Of the board as solved, without the corners that fewer than two views show: those were not solved for."""
    detections = zip(calibration.observations.detections, calibration.outliers, strict=True)
    table = CornerTable.of([detection.keeping(~outliers) for detection, outliers in detections])
    return flatness(calibration.board, solvable_corners(table, len(calibration.board.points)))


def not_flat(calibration: Calibration) -> tuple[Problem, ...]:
    """Said where the board as solved is out of flat by more than the seed allows."""
    height = flatness_of_solved(calibration).peak_to_valley_m
    if height <= FLATNESS_LIMIT_M:
        return ()
    remedy = (
        "its shape was solved for, so that the camera does not suffer; taken as flat, it would"
        if calibration.options.board_shape != "flat"
        else "solve for its shape, or use a flatter one"
    )
    message = (
        f"the board is {height * 1e3:.2f} mm out of flat, over the limit of {FLATNESS_LIMIT_M * 1e3:.1f} mm: {remedy}"
    )
    return (Problem("board-not-flat", message),)


def aligned(points: Points, target: Points) -> Points:
    """Points moved by the similarity that brings them closest to others, (n, 3) each."""
    middle, target_middle = points.mean(axis=0), target.mean(axis=0)
    centred, target_centred = points - middle, target - target_middle
    turn, product = turn_between(centred, target_centred)
    return np.asarray(product / (centred**2).sum() * centred @ turn.T + target_middle, dtype=np.float64)
