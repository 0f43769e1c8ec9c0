"""Whether to use a calibration, and what to do where not: the judgement a person would make.

The seed's procedure asks for about 50 views, the board tilted by 30 to 45 degrees to the optical axis, half of them
with the board horizontal and half vertical, filling the image, and an rms below 1 px.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Problem
from opencsp_calib.quality import SetQuality, ViewQuality, set_quality, view_qualities

__all__ = ["FEW_VIEWS", "RANGE_SPREAD", "REMARKS", "Verdict", "conclusion", "fold_inside", "judge", "verdict"]

MOST_NAMED = 5  # of the worst views, in one warning
RMS_LIMIT_PX = 1.0  # the seed: an rms over this is a poor calibration
HEAD_ON_DEG = 10.0  # foreshortening 1.5 %: below this, focal length and range can be exchanged for each other
PARALLEL_DEG = 10.0  # parallel planes share one vanishing line: two equations for fx, fy, cx, cy (Zhang 2000)
TILT_WANTED_DEG = (30.0, 45.0)
FEW_VIEWS = 10
COVERAGE_WANTED = 0.5
ASPECT_SIGMAS, LEAST_ASPECT = 3.0, 1e-5  # of fx: less matters to nobody, and no board is as true to size
RANGE_SPREAD = 1.1  # farthest over nearest view
DISQUALIFYING = ("poor-rms", "not-converged", "undetermined", "head-on", "parallel", "fold-inside")
REMARKS = ("board-as-given", "board-shape-solved")  # decisions told, not doubts
OF_ONE_WAY_UP = ("square-pixels-assumed", "pixel-aspect-open")  # say the same, and what became of it


@dataclass(frozen=True)
class Verdict:
    """Whether to use a calibration, said first.

    Parameters
    ----------
    level : 'good', 'doubt' or 'bad'
    sentence : str
    """

    level: Literal["good", "doubt", "bad"]
    sentence: str


def judge(calibration: Calibration) -> tuple[Problem, ...]:
    """What a person should know about the result: what was noted on the way, then what the views and numbers say."""
    views = view_qualities(calibration)
    whole = set_quality(calibration, views)
    found = [
        _poor_rms(calibration),
        _poor_views(views),
        _few_views(whole),
        _head_on(whole),
        _parallel(calibration, whole),
        _tilts(views),
        _coverage(whole),
        _one_way_up(calibration, whole),
        _one_range(whole),
        _aspect(calibration),
        fold_inside(calibration.camera),
    ]
    return calibration.problems + tuple(problem for problem in found if problem is not None)


def verdict(calibration: Calibration) -> Verdict:
    """What `judge` finds, in one sentence."""
    return conclusion(judge(calibration))


def conclusion(problems: Sequence[Problem]) -> Verdict:
    """What `judge` found, in one sentence."""
    bad = [problem for problem in problems if problem.code in DISQUALIFYING]
    doubts = [problem for problem in problems if problem.code not in (*DISQUALIFYING, *REMARKS)]
    if bad:
        return Verdict("bad", f"Do not use this calibration: {bad[0].message}.")
    if doubts:
        warnings = "one warning" if len(doubts) == 1 else f"{len(doubts)} warnings"
        return Verdict("doubt", f"Usable, with {warnings} that you should read first.")
    return Verdict("good", "A good calibration: nothing found that speaks against using it.")


def _poor_rms(calibration: Calibration) -> Problem | None:
    if calibration.rms_px <= RMS_LIMIT_PX:
        return None
    doubted = "the board's columns, rows and flatness"
    if not calibration.camera.distortion.size:
        doubted += f", and take a lens model with distortion, which {calibration.camera.model} has not"
    message = (
        f"the rms of {calibration.rms_px:.2f} px is over {RMS_LIMIT_PX:.1f} px, a poor calibration: discard the worst "
        f"images, retake them and repeat; if all are bad, check {doubted}"
    )
    return Problem("poor-rms", message)


def _poor_views(views: tuple[ViewQuality, ...]) -> Problem | None:
    poor = sorted((view for view in views if view.rms_px > RMS_LIMIT_PX), key=lambda view: -view.rms_px)
    if not poor:
        return None
    named = ", ".join(f"{view.image} ({view.rms_px:.2f} px)" for view in poor[:MOST_NAMED])
    more = f" and {len(poor) - MOST_NAMED} more" if len(poor) > MOST_NAMED else ""
    verb, them = ("has", "it") if len(poor) == 1 else ("have", "them")
    message = f"{named}{more} {verb} an rms over {RMS_LIMIT_PX:.1f} px: discard {them} or retake {them}"
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


def _parallel(calibration: Calibration, whole: SetQuality) -> Problem | None:
    normals = np.array([pose.matrix[:, 2] for pose in calibration.cam_from_board])
    widest = float(np.degrees(np.arccos(np.clip(normals @ normals.T, -1.0, 1.0).min())))
    if widest >= PARALLEL_DEG or whole.tilts_deg[2] < HEAD_ON_DEG or whole.views < 2:
        return None
    message = (
        f"all views hold the board parallel, within {widest:.0f} degrees: nothing but the distortion tells the focal "
        "length and the principal point then; tilt the board by 30 to 45 degrees to the left, right, up and down"
    )
    return Problem("parallel", message)


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


def _one_way_up(calibration: Calibration, whole: SetQuality) -> Problem | None:
    if min(whole.horizontal, whole.vertical) > 0 or whole.views < 2:
        return None
    if any(problem.code in OF_ONE_WAY_UP for problem in calibration.problems):
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
    if calibration.options.pixel_aspect is not None:  # as somebody wanted it
        return None
    fx, fy = calibration.camera.params[:2]
    (a, b), (_, d) = calibration.covariance[:2, :2]
    sigma = np.sqrt(max(a + d - 2 * b, 0.0))
    if not (sigma > 0 and abs(fx - fy) > max(ASPECT_SIGMAS * sigma, LEAST_ASPECT * fx)):
        return None
    cure = (
        "the board's spacing may differ in x and y: solve for its shape, or measure it"
        if calibration.options.board_shape == "flat"
        else "hold the pixel aspect at square unless you know better"
    )
    message = (
        f"fx and fy differ by {fx - fy:+.3g} px, which is known to {sigma:.2g} px (they are known together, not one by "
        f"one); most sensors have square pixels, so {cure}"
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
