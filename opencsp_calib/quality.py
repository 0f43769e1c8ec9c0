"""What a calibration's views are like, one by one and together: tilt, range, coverage."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, TypeAlias

import numpy as np

from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration
from opencsp_calib.convex_hull import convex_hull, hull_area, within_hull
from opencsp_calib.detection import Observations
from opencsp_calib.pose import Pose

__all__ = [
    "Orientation",
    "SetQuality",
    "ViewQuality",
    "correlations",
    "coverage",
    "held",
    "range_of",
    "set_quality",
    "view_qualities",
    "worst_views",
]

Orientation: TypeAlias = Literal["horizontal", "vertical"]

COVERAGE_CELLS = 48  # along the longer side of the image


@dataclass(frozen=True)
class ViewQuality:
    """What one used view is like.

    Parameters
    ----------
    image : str
    corners : int
        That took part.
    rms_px : float
    tilt_deg : float
        Between the board's normal and the optical axis: 0 is head-on.
    roll_deg : float
        Of the board's x axis in the image, -180 to 180.
    orientation : 'horizontal' or 'vertical'
        See `held`.
    range_m : float
        From the camera to the middle of the board.
    area : float
        Share of the image within the corners' convex hull.
    edge_width_px : float
        Median over the corners; NaN where not known.
    """

    image: str
    corners: int
    rms_px: float
    tilt_deg: float
    roll_deg: float
    orientation: Orientation
    range_m: float
    area: float
    edge_width_px: float


@dataclass(frozen=True)
class SetQuality:
    """What the used views are like together.

    Parameters
    ----------
    views : int
    tilts_deg, ranges_m : (float, float, float)
        Smallest, median, largest.
    coverage : float
        Share of the image that lies within the corners of at least one view.
    horizontal, vertical : int
        How many views hold the board which way.
    """

    views: int
    tilts_deg: tuple[float, float, float]
    ranges_m: tuple[float, float, float]
    coverage: float
    horizontal: int
    vertical: int


def view_qualities(calibration: Calibration) -> tuple[ViewQuality, ...]:
    """What each used view is like, in order."""
    board, results = calibration.board, []
    views = zip(
        calibration.observations.used,
        calibration.cam_from_board,
        calibration.outliers,
        calibration.view_rms_px,
        strict=True,
    )
    for view, pose, outliers, rms in views:
        matrix = pose.matrix
        widths = view.detection.edge_width_px
        results.append(
            ViewQuality(
                image=view.image,
                corners=int((~outliers).sum()),
                rms_px=float(rms),
                tilt_deg=pose.tilt_deg,
                roll_deg=float(np.degrees(np.arctan2(matrix[1, 0], matrix[0, 0]))),
                orientation=held(board, pose),
                range_m=range_of(board, pose),
                area=hull_area(convex_hull(view.detection.pixels)) / np.prod(calibration.camera.image_size),
                edge_width_px=float("nan") if widths is None else float(np.median(widths)),
            )
        )
    return tuple(results)


def held(board: Board, pose: Pose) -> Orientation:
    """How the board's longer side runs: ``horizontal``, along the image's width, or ``vertical``, along its height."""
    columns, rows = board.grid
    longer = pose.matrix[:, 0] if columns >= rows else pose.matrix[:, 1]
    return "horizontal" if abs(longer[0]) >= abs(longer[1]) else "vertical"


def range_of(board: Board, pose: Pose) -> float:
    """From the camera to the middle of the board, metres."""
    return float(np.linalg.norm(pose.transform(board.points.mean(axis=0)[None])[0]))


def worst_views(calibration: Calibration, count: int = 5) -> tuple[int, ...]:
    """Which of the used views have the largest rms, the worst first; those whose rms is not known come last."""
    return tuple(np.argsort(-np.nan_to_num(calibration.view_rms_px), kind="stable")[:count].tolist())


def set_quality(calibration: Calibration, views: Sequence[ViewQuality] = ()) -> SetQuality:
    """What the used views are like together; `view_qualities` of them can be given, where they are known."""
    views = views or view_qualities(calibration)
    horizontal = sum(view.orientation == "horizontal" for view in views)
    return SetQuality(
        views=len(views),
        tilts_deg=_spread([view.tilt_deg for view in views]),
        ranges_m=_spread([view.range_m for view in views]),
        coverage=coverage(calibration.observations),
        horizontal=horizontal,
        vertical=len(views) - horizontal,
    )


def coverage(observations: Observations) -> float:
    """Share of the image that lies within the corners' convex hull of at least one used view."""
    width, height = observations.image_size
    cell = max(width, height) / COVERAGE_CELLS
    x, y = np.meshgrid(np.arange(cell / 2, width, cell) - 0.5, np.arange(cell / 2, height, cell) - 0.5)
    cells = np.column_stack([x.ravel(), y.ravel()])
    covered = np.zeros(len(cells), dtype=bool)
    for detection in observations.detections:
        covered |= within_hull(convex_hull(detection.pixels), cells)
    return float(covered.mean())


def correlations(calibration: Calibration) -> Matrix:
    """(P, P) correlations of the camera's parameters; NaN where the covariance is not known."""
    sigma = calibration.sigma
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(calibration.covariance / np.outer(sigma, sigma), dtype=np.float64)


def _spread(values: list[float]) -> tuple[float, float, float]:
    array: Floats = np.array(values)
    return float(array.min()), float(np.median(array)), float(array.max())
