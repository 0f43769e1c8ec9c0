"""The same calibration from other views: halves, folds, leaving one out. What changes is what cannot be trusted.

Everything here takes `solve` as an argument: any function of observations that returns a calibration.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from opencsp_calib.arrays import Floats, Mask
from opencsp_calib.calibration import Calibration, Solve
from opencsp_calib.comparison import Difference, compare
from opencsp_calib.detection import Observations
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.normal_equations import NormalEquations, normal_equations
from opencsp_calib.pose_fit import pose_residuals
from opencsp_calib.schur import factorise

__all__ = [
    "HalvesDifference",
    "HeldOut",
    "compare_halves",
    "folds",
    "half_steps",
    "halves",
    "held_out",
    "known_corners",
    "leaving_each_out",
    "nearby_halves",
]

HALVES = slice(0, None, 2), slice(1, None, 2)


@dataclass(frozen=True, eq=False)
class HalvesDifference:
    """Two calibrations from views that have nothing in common but camera and board.

    Parameters
    ----------
    first, second : Calibration
        From the odd and from the even views: 1st, 3rd, 5th.. and 2nd, 4th, 6th..
    difference : Difference
        Of their cameras.
    """

    first: Calibration = field(repr=False)
    second: Calibration = field(repr=False)
    difference: Difference


@dataclass(frozen=True, eq=False)
class HeldOut:
    """How well calibrations explain views they have not seen, nothing but the views' poses being fitted.

    It tells a wrong board from a right one, and shows a model too rich for its data; it is nearly blind to wrong
    intrinsics, because each view's pose is fitted to them.

    Parameters
    ----------
    rms_px : float
        Over all held-out corners.
    images : tuple of str
        The views held out.
    view_rms_px : (V,)
        Of each of them.
    """

    rms_px: float
    images: tuple[str, ...] = field(repr=False)
    view_rms_px: Floats = field(repr=False)


def halves(observations: Observations) -> tuple[Observations, Observations]:
    """The odd views and the even ones, counted among those used and from one: neighbours in time are parted.

    Raises
    ------
    InputError
        If there are fewer than four used views.
    """
    images = [view.image for view in observations.used]
    if len(images) < 4:
        raise InputError(f"{len(images)} views cannot be parted into halves; take at least four")
    first, second = (observations.keeping(images[half]) for half in HALVES)
    return first, second


def folds(observations: Observations, count: int = 5) -> tuple[tuple[Observations, Observations], ...]:
    """Pairs of views to solve from and views held out; every used view is held out once.

    Raises
    ------
    InputError
        If there are fewer than two folds, or fewer used views than folds.
    """
    images = [view.image for view in observations.used]
    if not 2 <= count <= len(images):
        raise InputError(f"{len(images)} views cannot be parted into {count} folds")
    held = [set(images[k::count]) for k in range(count)]
    return tuple((observations.keeping(set(images) - fold), observations.keeping(fold)) for fold in held)


def leaving_each_out(observations: Observations) -> tuple[Observations, ...]:
    """As many sets as there are used views, each without one of them."""
    return tuple(observations.dropping([view.image]) for view in observations.used)


def compare_halves(observations: Observations, solve: Solve, *, range_m: float | None = None) -> HalvesDifference:
    """Solve the odd and the even views apart and compare the cameras by projection.

    Raises
    ------
    InputError
        If there are fewer than four used views, or `solve` refuses a half.
    CalibrationFailedError
        If `solve` finds no result for a half.
    """
    first, second = (solve(half) for half in halves(observations))
    return HalvesDifference(first, second, compare(first.camera, second.camera, range_m=range_m))


def nearby_halves(calibration: Calibration, *, range_m: float | None = None) -> Difference:
    """What `compare_halves` finds, to first order and at hardly any cost: each half a Newton step from the whole.

    Raises
    ------
    InputError
        If there are fewer than four used views.
    CalibrationFailedError
        If a half does not determine the camera.
    """
    halves(calibration.observations)  # refused where there are too few views
    camera = calibration.camera
    first, second = (replace(camera, params=camera.params + step) for step in half_steps(normal_equations(calibration)))
    return compare(first, second, range_m=range_m)


def half_steps(equations: NormalEquations) -> Floats:
    """(2, P) how the odd and the even views, each alone, would move the camera, poses and board moving with it.

    Raises
    ------
    CalibrationFailedError
        If a half does not determine the camera.
    """
    try:
        steps = [factorise(equations.keeping(half)).step_without_poses() for half in HALVES]
    except np.linalg.LinAlgError as error:
        raise CalibrationFailedError(f"half of the views do not determine the camera ({error})") from None
    return np.array([equations.unknowns.of_camera(step) for step in steps])


def held_out(pairs: tuple[tuple[Observations, Observations], ...], solve: Solve) -> HeldOut:
    """Solve from the first of each pair and explain the views of the second by it.

    Parameters
    ----------
    pairs : tuple of (Observations, Observations)
        Such as `folds` makes.
    solve : callable
        Its board as solved is used; where its shape was free, without the corners that too few views showed.

    Raises
    ------
    InputError, CalibrationFailedError
        As `solve` and `fit_pose`.
    """
    images, squares = [], []
    for training, test in pairs:
        calibration = solve(training)
        known = known_corners(calibration)
        for view in test.used:
            detection = view.detection.keeping(known[view.detection.ids])
            error = pose_residuals(calibration.camera, calibration.board, detection)
            images.append(view.image)
            squares.append((error**2).sum(axis=1))
    rms = float(np.sqrt(np.concatenate(squares).mean()))
    return HeldOut(rms, tuple(images), np.sqrt([s.mean() for s in squares]))


def known_corners(calibration: Calibration) -> Mask:
    """(K,) the corners whose place on the board is known: as given, or solved for from two views at least."""
    count = len(calibration.board.points)
    if calibration.options.board_shape != "free":
        return np.ones(count, dtype=np.bool_)
    detections = zip(calibration.observations.detections, calibration.outliers, strict=True)
    ids = np.concatenate([detection.ids[~outliers] for detection, outliers in detections])
    return np.asarray(np.bincount(ids, minlength=count) >= 2)
