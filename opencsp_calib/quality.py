"""What a calibration's views are like, and what is wrong with the set: the judgement a person would make.

The seed's procedure asks for about 50 views, the board tilted by 30 to 45 degrees to the optical axis, half of them
with the board horizontal and half vertical, filling the image, and an rms below 1 px.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from opencsp_calib.arrays import Floats, Matrix, Pixels
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Observations, Problem

__all__ = ["SetQuality", "ViewQuality", "correlations", "coverage", "judge", "set_quality", "view_qualities"]

RMS_LIMIT_PX = 1.0  # the seed: an rms over this is a poor calibration
HEAD_ON_DEG = 10.0  # foreshortening 1.5 %: below this, focal length and range can be exchanged for each other
TILT_WANTED_DEG = (30.0, 45.0)
FEW_VIEWS = 10
COVERAGE_WANTED = 0.5
ASPECT_SIGMAS = 3.0
RANGE_SPREAD = 1.1
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
        Of the board's columns direction in the image, -180 to 180.
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
    range_m: float
    area: float
    edge_width_px: float

    @property
    def orientation(self) -> Literal["horizontal", "vertical"]:
        """Whether the board's columns direction runs along the image's width or its height."""
        return "horizontal" if abs(np.cos(np.radians(self.roll_deg))) >= np.sqrt(0.5) else "vertical"


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
    board_middle = calibration.board.points.mean(axis=0)
    results = []
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
                tilt_deg=float(np.degrees(np.arccos(min(1.0, abs(matrix[2, 2]))))),
                roll_deg=float(np.degrees(np.arctan2(matrix[1, 0], matrix[0, 0]))),
                range_m=float(np.linalg.norm(pose.transform(board_middle[None])[0])),
                area=_hull_area(view.detection.pixels) / np.prod(calibration.camera.image_size),
                edge_width_px=float("nan") if widths is None else float(np.median(widths)),
            )
        )
    return tuple(results)


def set_quality(calibration: Calibration) -> SetQuality:
    """What the used views are like together."""
    views = view_qualities(calibration)
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
        hull = _hull(detection.pixels)
        if hull is not None:
            covered |= (cells @ hull.equations[:, :2].T + hull.equations[:, 2] <= 0).all(axis=1)
    return float(covered.mean())


def correlations(calibration: Calibration) -> Matrix:
    """(P, P) correlations of the camera's parameters; NaN where the covariance is not known."""
    sigma = calibration.sigma
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(calibration.covariance / np.outer(sigma, sigma), dtype=np.float64)


def judge(calibration: Calibration) -> tuple[Problem, ...]:
    """What a person should know about the result: what was noted on the way, then what the views and numbers say."""
    views, whole = view_qualities(calibration), set_quality(calibration)
    found = [
        _poor_rms(calibration),
        *(_poor_view(view) for view in views),
        _few_views(whole),
        _head_on(whole),
        _tilts(views),
        _coverage(whole),
        _one_way_up(whole),
        _one_range(whole),
        _aspect(calibration),
        fold_inside(calibration.camera),
    ]
    return calibration.problems + tuple(problem for problem in found if problem is not None)


def _poor_rms(calibration: Calibration) -> Problem | None:
    if calibration.rms_px <= RMS_LIMIT_PX:
        return None
    message = (
        f"the rms of {calibration.rms_px:.2f} px is over {RMS_LIMIT_PX:.1f} px, a poor calibration: discard the worst "
        "images, retake them and repeat; if all are bad, check the board's columns, rows and flatness"
    )
    return Problem("poor-rms", message)


def _poor_view(view: ViewQuality) -> Problem | None:
    if not view.rms_px > RMS_LIMIT_PX:
        return None
    message = f"{view.image} has an rms of {view.rms_px:.2f} px, over {RMS_LIMIT_PX:.1f} px: discard it or retake it"
    return Problem("poor-view", message)


def _few_views(whole: SetQuality) -> Problem | None:
    if whole.views >= FEW_VIEWS:
        return None
    message = f"only {whole.views} views are used; take about 50, at least {FEW_VIEWS}"
    return Problem("few-views", message)


def _head_on(whole: SetQuality) -> Problem | None:
    if whole.tilts_deg[2] >= HEAD_ON_DEG:
        return None
    message = (
        f"no view tilts the board by more than {whole.tilts_deg[2]:.0f} degrees: the focal length is not determined; "
        "take views with the board tilted by 30 to 45 degrees"
    )
    return Problem("head-on", message)


def _tilts(views: tuple[ViewQuality, ...]) -> Problem | None:
    low, high = TILT_WANTED_DEG
    outside = sum(not low - 5 <= view.tilt_deg <= high + 5 for view in views)
    if outside <= len(views) / 2:
        return None
    message = f"{outside} of {len(views)} views tilt the board by less than {low:.0f} or more than {high:.0f} degrees"
    return Problem("tilts", message + "; views within that give the most accurate focal length")


def _coverage(whole: SetQuality) -> Problem | None:
    if whole.coverage >= COVERAGE_WANTED:
        return None
    message = (
        f"the corners of all views cover only {whole.coverage:.0%} of the image: the distortion is a guess elsewhere; "
        "take views with the board near the edges and corners of the image"
    )
    return Problem("low-coverage", message)


def _one_way_up(whole: SetQuality) -> Problem | None:
    if min(whole.horizontal, whole.vertical) > 0 or whole.views < 2:
        return None
    way = "horizontal" if whole.horizontal else "vertical"
    message = (
        f"all views hold the board {way}, so that fx/fy and a difference of the board's spacing in x and y cannot be "
        "told apart; take half of the views with the board turned by 90 degrees"
    )
    return Problem("one-orientation", message)


def _one_range(whole: SetQuality) -> Problem | None:
    near, _, far = whole.ranges_m
    if far > RANGE_SPREAD * near or whole.views < 2:
        return None
    message = (
        f"all views are {near:.2f} to {far:.2f} m away: trust the result at that range; vary the distance for more"
    )
    return Problem("one-range", message)


def _aspect(calibration: Calibration) -> Problem | None:
    fx, fy = calibration.camera.params[:2]
    (a, b), (_, d) = calibration.covariance[:2, :2]
    sigma = np.sqrt(max(a + d - 2 * b, 0.0))
    if not (sigma > 0 and abs(fx - fy) > ASPECT_SIGMAS * sigma):
        return None
    message = (
        f"fx and fy differ by {fx - fy:+.2f} px, {abs(fx - fy) / sigma:.0f} times its standard deviation; most sensors "
        "have square pixels, so the board's spacing may differ in x and y: solve for the board's shape, or measure it"
    )
    return Problem("fx-fy-differ", message)


def fold_inside(camera: Camera) -> Problem | None:
    """Said where the distortion folds back within the image, so that some pixels see no direction."""
    width, height = camera.image_size
    x, y = np.linspace(-0.5, width - 0.5, 33), np.linspace(-0.5, height - 0.5, 33)
    border = np.concatenate([[(u, v) for u in x for v in (y[0], y[-1])], [(u, v) for v in y for u in (x[0], x[-1])]])
    blind = np.isnan(camera.unproject(border)).any(axis=1)
    if not blind.any():
        return None
    message = (
        f"the distortion folds back inside the image ({blind.mean():.0%} of its border sees no direction): the model "
        "is wrong there; take views that reach the image's corners, or use a model with fewer coefficients"
    )
    return Problem("fold-inside", message)


def _hull(pixels: Pixels) -> "ConvexHull | None":
    try:
        return ConvexHull(pixels) if len(pixels) >= 3 else None
    except QhullError:  # all on one line
        return None


def _hull_area(pixels: Pixels) -> float:
    hull = _hull(pixels)
    return float(hull.volume) if hull is not None else 0.0  # Qhull's "volume" of a plane figure is its area


def _spread(values: list[float]) -> tuple[float, float, float]:
    array: Floats = np.array(values)
    return float(array.min()), float(np.median(array)), float(array.max())
