"""Whether a camera calibrated before, or imported, is still good for new photographs.

Residuals alone do not tell: each view's pose is fitted, and hides much of what has changed. So the camera is solved
afresh from the same photographs, and the two are compared by projection: at the range where the board was, and at
infinity. At one range a shift of the frame makes up for nearly all of another focal length (for 0.5 % of it, on a
camera as Sandia's, the difference is within the noise), so that the range alone would call a refocused lens good; at
infinity nothing makes up for it.

A few photographs do not determine a board's shape. Where it was solved for together with the camera, and explains them
better than the board as given, they are solved with it: a board that is not flat would make a good camera look wrong.
"""

from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration, Solve
from opencsp_calib.camera import Camera
from opencsp_calib.comparison import Difference, compare
from opencsp_calib.detection import Observations, Problem
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.pose_fit import pose_residuals
from opencsp_calib.projection_sigma import camera_sigma_map, sigma_map
from opencsp_calib.uncertainty import student_factor, with_uncertainty

__all__ = ["Check", "CheckVerdict", "Judged", "check", "judged", "worse"]

CheckVerdict: TypeAlias = Literal["ok", "degraded", "wrong"]
"""On a camera, from new photographs of it."""

SEVERITY: tuple[CheckVerdict, ...] = ("ok", "degraded", "wrong")
OK_SIGMAS = 2.0
WRONG_SIGMAS = 5.0
WRONG_PX = 1.0
OF_MANY_VIEWS = 1.96  # what `student_factor` tends to: a sigma from few views is itself uncertain


@dataclass(frozen=True, eq=False)
class Judged:
    """One comparison, and what uncertainty alone would explain of it.

    Parameters
    ----------
    difference : Difference
        From the fresh camera to the one checked, frames aligned.
    predicted_px : float
        One sigma of its rms over the image; larger where it comes from few views, as Student's t has it.
    """

    difference: Difference = field(repr=False)
    predicted_px: float

    @property
    def sigmas(self) -> float:
        """How many sigmas the difference is."""
        return self.difference.rms_px / self.predicted_px

    @property
    def too_weak(self) -> bool:
        """Whether two sigmas are more than a pixel."""
        return OK_SIGMAS * self.predicted_px > WRONG_PX

    @property
    def verdict(self) -> CheckVerdict:
        """``ok``: no farther off than two sigmas; ``wrong``: beyond five, or by more than 1 px; else ``degraded``.

        Where the photographs are so few that two sigmas are more than a pixel, a pixel says neither that it is ok nor
        that it is wrong.
        """
        off_by_a_pixel = self.difference.worst_px > WRONG_PX
        if self.sigmas <= OK_SIGMAS:
            return "degraded" if off_by_a_pixel else "ok"
        telling = off_by_a_pixel and not self.too_weak
        return "wrong" if self.sigmas > WRONG_SIGMAS or telling else "degraded"


@dataclass(frozen=True, eq=False)
class Check:
    """How a camera does on photographs it was not calibrated from.

    Parameters
    ----------
    camera : Camera
        Which was checked.
    fresh : Calibration
        Solved from the photographs.
    at_range, at_infinity : Judged
        At the median distance of the corners from the camera, and at infinity.
    view_rms_px : (V,)
        Residuals of each used view with the camera held and only the pose fitted, on the board as the fresh solution
        has it; NaN where the camera cannot see the corners at all.
    """

    camera: Camera
    fresh: Calibration = field(repr=False)
    at_range: Judged
    at_infinity: Judged
    view_rms_px: Floats = field(repr=False)

    @property
    def decisive(self) -> Judged:
        """The comparison with the worse verdict; of two alike, the one that is more sigmas off."""
        return worse(self.at_range, self.at_infinity)

    @property
    def verdict(self) -> CheckVerdict:
        """The worse of the two; see `Judged.verdict`."""
        return self.decisive.verdict

    @property
    def problems(self) -> tuple[Problem, ...]:
        """What a person should know: what is said of the fresh solution, and where it is too weak to judge by."""
        if not self.decisive.too_weak:
            return self.fresh.problems
        message = (
            f"these photographs determine the camera to {self.decisive.predicted_px:.2g} px only, too little to judge "
            "another by: take more, with the board tilted and all over the image"
        )
        return (Problem("check-too-weak", message), *self.fresh.problems)

    @property
    def reasons(self) -> tuple[str, ...]:
        """For people: what the verdict rests on, the most important first."""
        compared = [_sentence(one) for one in sorted((self.at_range, self.at_infinity), key=lambda j: -j.sigmas)]
        return (*compared, self._of_residuals())

    def _of_residuals(self) -> str:
        blind = [
            v.image for v, rms in zip(self.fresh.observations.used, self.view_rms_px, strict=True) if np.isnan(rms)
        ]
        if blind:
            return f"no pose explains what is seen in {', '.join(blind)} with this camera"
        here, there = np.median(self.view_rms_px), np.median(self.fresh.view_rms_px)
        return f"with only poses fitted, the median view's rms is {here:.3g} px; in the fresh solution {there:.3g} px"

    def as_json(self) -> dict[str, Any]:
        """What ``check --json`` prints."""
        apart = self.decisive.difference
        return {
            "rms_px": apart.rms_px,
            "worst_px": apart.worst_px,
            "predicted_px": self.decisive.predicted_px,
            "verdict": self.verdict,
        }


def check(
    camera: Camera,
    observations: Observations,
    solve: Solve,
    known: Calibration | None = None,
) -> Check:
    """Hold a camera against new photographs.

    Parameters
    ----------
    camera : Camera
        Of any lens model.
    observations : Observations
        Of the photographs.
    solve : callable
        Makes the fresh calibration; its lens model may be another.
    known : Calibration, optional
        Which the camera checked is from: its uncertainty explains a part of the difference, and the board as solved
        with it may explain the photographs.

    Raises
    ------
    InputError
        If the photographs are of another size.
    CalibrationFailedError
        If no fresh solution comes out of them, or none whose uncertainty is known.
    """
    if camera.image_size != observations.image_size:
        sizes = " but the camera is for ".join(f"{w}x{h}" for w, h in (observations.image_size, camera.image_size))
        raise InputError(f"the photographs are {sizes}: they are not from this camera, or were resized")
    fresh = _solved_with(known.board if known else None, observations, solve)
    if not np.isfinite(fresh.covariance).all():
        fresh = with_uncertainty(fresh)
    if not np.isfinite(fresh.covariance).all():
        said = fresh.problems[-1].message if fresh.problems else "its uncertainty is not known"
        raise CalibrationFailedError(f"no fresh solution to check against: {said}")
    at_range, at_infinity = judged(camera, fresh, known.covariance if known else None)
    return Check(camera, fresh, at_range, at_infinity, _view_rms(camera, fresh))


def _solved_with(known: Board | None, observations: Observations, solve: Solve) -> Calibration:
    """The fresh solution, with the board as it was solved before where that explains the photographs better."""
    fresh, given = solve(observations), observations.board
    if fresh.options.board_shape != "flat" or known is None or np.array_equal(known.points, given.points):
        return fresh
    if not (known.nominal_points.shape == given.points.shape and np.allclose(known.nominal_points, given.points)):
        return fresh
    other = solve(observations.with_board(known))
    if not other.rms_px < fresh.rms_px:
        return fresh
    message = (
        "the board was taken as it was solved together with this camera, because these photographs do not tell its "
        "shape and it explains them better than a flat board: errors that the camera and that board share do not show; "
        "with more photographs, the board turned and tilted, its shape would be solved for again"
    )
    kept = tuple(problem for problem in other.problems if problem.code != "board-as-given")
    return replace(other, problems=(*kept, Problem("board-solved-before", message)))


def judged(camera: Camera, fresh: Calibration, covariance: Matrix | None = None) -> tuple[Judged, Judged]:
    """A camera compared with a fresh calibration: at the range where the boards were, and at infinity."""
    at_range, at_infinity = (
        Judged(compare(fresh.camera, camera, range_m=r), _predicted(camera, fresh, covariance, r))
        for r in (_working_range(fresh), None)
    )
    return at_range, at_infinity


def worse(*found: Judged) -> Judged:
    """The one with the worse verdict; of two alike, the one that is more sigmas off."""
    return max(found, key=lambda one: (SEVERITY.index(one.verdict), one.sigmas))


def _predicted(camera: Camera, fresh: Calibration, covariance: Matrix | None, range_m: float | None) -> float:
    views = len(fresh.cam_from_board)
    predicted = sigma_map(fresh, range_m).rms_px * student_factor(views) / OF_MANY_VIEWS
    if covariance is None or not np.isfinite(covariance).all():
        return predicted
    return float(np.hypot(predicted, camera_sigma_map(camera, covariance, range_m).rms_px))


def _sentence(judged: Judged) -> str:
    apart = judged.difference
    return (
        f"{apart.where} the camera is {apart.rms_px:.2g} px rms ({apart.worst_px:.2g} px at worst) off a fresh "
        f"solution; uncertainty explains {judged.predicted_px:.2g} px rms: {judged.verdict}"
    )


def _working_range(calibration: Calibration) -> float:
    pairs = zip(calibration.cam_from_board, calibration.observations.detections, strict=True)
    points = np.concatenate([pose.transform(calibration.board.points[d.ids]) for pose, d in pairs])
    return float(np.median(np.linalg.norm(points, axis=1)))


def _view_rms(camera: Camera, fresh: Calibration) -> Floats:
    found = []
    for detection, outliers in zip(fresh.observations.detections, fresh.outliers, strict=True):
        try:
            residuals = pose_residuals(camera, fresh.board, detection.keeping(~outliers))
            found.append(float(np.sqrt((residuals**2).sum(axis=1).mean())))
        except CalibrationFailedError:  # the camera cannot see the board there: as wrong as can be
            found.append(float("nan"))
    return np.array(found)
