"""What a person should know about how a calibration was solved: outliers, weights, the board, the pixel aspect."""

import numpy as np

from opencsp_calib import Calibration, Problem
from opencsp_calib.board_shape import TURNED_DEG, roll_spread_deg

__all__ = ["remarks"]

MANY_OUTLIERS = 0.03


def remarks(calibration: Calibration) -> tuple[Problem, ...]:
    """What a person should know about how it was solved."""
    return (*_of_outliers(calibration), *_of_weights(calibration), *_of_board(calibration), *_of_aspect(calibration))


def _of_outliers(calibration: Calibration) -> tuple[Problem, ...]:
    counts = np.array([mask.sum() for mask in calibration.outliers])
    total = sum(len(mask) for mask in calibration.outliers)
    if calibration.rejected_corners <= MANY_OUTLIERS * total:
        return ()
    worst = np.argsort(-counts, kind="stable")[:3]
    images = [f"{calibration.observations.used[v].image} ({counts[v]})" for v in worst if counts[v]]
    message = (
        f"{calibration.rejected_corners} of {total} corners are outliers, which is suspicious; most of them in "
        f"{', '.join(images)}: look at these, and check the board's description"
    )
    return (Problem("many-outliers", message),)


def _of_weights(calibration: Calibration) -> tuple[Problem, ...]:
    without = [view.image for view in calibration.observations.used if view.detection.covariance is None]
    if calibration.options.weights == "equal" or not without:
        return ()
    views = len(calibration.observations.used)
    which = "no view has" if len(without) == views else f"{len(without)} of {views} views (first {without[0]}) have no"
    message = f"{which} covariances of corners: those count equally; refine the corners by model fit"
    return (Problem("corners-without-covariance", message),)


def _of_board(calibration: Calibration) -> tuple[Problem, ...]:
    if calibration.options.board_shape != "free":
        return ()
    kept = [d.ids[~o] for d, o in zip(calibration.observations.detections, calibration.outliers, strict=True)]
    seen = np.bincount(np.concatenate(kept), minlength=len(calibration.board.points))
    few = np.flatnonzero(seen < 2)
    if not few.size:
        return ()
    message = (
        f"{few.size} of the board's corners (first: {few[0]}) are seen in fewer than two views, which leaves them "
        "open: those never seen are where they were given, the others where their view sees them"
    )
    return (Problem("board-corners-open", message),)


def _of_aspect(calibration: Calibration) -> tuple[Problem, ...]:
    if calibration.options.board_shape == "flat" or calibration.options.pixel_aspect is not None:
        return ()
    spread = roll_spread_deg(calibration.cam_from_board)
    if spread > TURNED_DEG:
        return ()
    message = (
        f"fx/fy and a difference of the board's spacing in x and y cannot be told apart: no two views turn the board "
        f"by more than {spread:.0f} degrees against each other; hold the pixel aspect (square pixels), or take views "
        "with the board turned by 90 degrees"
    )
    return (Problem("pixel-aspect-open", message),)
