"""Whether a camera calibrated before, or imported, is still good for new photographs.

Residuals alone do not tell: each view's pose is fitted, and hides much of what has changed. So the camera is solved
afresh from the same photographs, and the two are compared by projection at the range where the board was.
"""

from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np

from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.comparison import Difference, compare
from opencsp_calib.detection import Observations, Problem
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.pose_fit import pose_residuals
from opencsp_calib.projection_sigma import camera_sigma_map, sigma_map
from opencsp_calib.resampling import Solve
from opencsp_calib.uncertainty import with_uncertainty

__all__ = ["Check", "Verdict", "check"]

Verdict = Literal["ok", "degraded", "wrong"]

OK_SIGMAS = 2.0
WRONG_SIGMAS = 5.0
WRONG_PX = 1.0


@dataclass(frozen=True, eq=False)
class Check:
    """How a camera does on photographs it was not calibrated from.

    Parameters
    ----------
    camera : Camera
        Which was checked.
    fresh : Calibration
        Solved from the photographs.
    range_m : float
        Where the cameras are compared: the median distance of the corners from the camera.
    difference : Difference
        From the fresh camera to the one checked, frames aligned.
    predicted_px : float
        The rms difference over the image that uncertainty alone explains, one sigma.
    view_rms_px : (V,)
        Residuals of each used view with the camera held and only the pose fitted, on the board as the fresh solution
        has it; NaN where the camera cannot see the corners at all.
    """

    camera: Camera
    fresh: Calibration = field(repr=False)
    range_m: float
    difference: Difference = field(repr=False)
    predicted_px: float
    view_rms_px: Floats = field(repr=False)

    @property
    def verdict(self) -> Verdict:
        """``ok``: no farther off than two sigmas; ``wrong``: beyond five, or by more than 1 px; else ``degraded``.

        Where the photographs are so few that two sigmas are more than a pixel, they cannot say that it is ok.
        """
        rms, worst = self.difference.rms_px, self.difference.worst_px
        if rms > WRONG_SIGMAS * self.predicted_px:
            return "wrong"
        if rms > OK_SIGMAS * self.predicted_px:
            return "wrong" if worst > WRONG_PX else "degraded"
        return "ok" if worst <= WRONG_PX else "degraded"

    @property
    def problems(self) -> tuple[Problem, ...]:
        """What a person should know: what is said of the fresh solution, and where it is too weak to judge by."""
        if not OK_SIGMAS * self.predicted_px > WRONG_PX:
            return self.fresh.problems
        message = (
            f"these photographs determine the camera to {self.predicted_px:.2g} px only, too little to judge another "
            "by: take more, with the board tilted and all over the image"
        )
        return (Problem("check-too-weak", message), *self.fresh.problems)

    @property
    def reasons(self) -> tuple[str, ...]:
        """For people: what the verdict rests on, and what there is to say of the photographs."""
        apart = self.difference
        off = (
            f"at {self.range_m:.2f} m the camera is {apart.rms_px:.2g} px rms ({apart.worst_px:.2g} px at worst) off a "
            f"fresh solution; uncertainty explains {self.predicted_px:.2g} px rms"
        )
        return (off, self._of_residuals(), *(problem.message for problem in self.problems))

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
        rms, worst = self.difference.rms_px, self.difference.worst_px
        return {"rms_px": rms, "worst_px": worst, "predicted_px": self.predicted_px, "verdict": self.verdict}


def check(camera: Camera, observations: Observations, solve: Solve, *, covariance: Matrix | None = None) -> Check:
    """Hold a camera against new photographs.

    Parameters
    ----------
    camera : Camera
        Of any lens model.
    observations : Observations
        Of the photographs.
    solve : callable
        Makes the fresh calibration; its lens model may be another.
    covariance : (P, P), optional
        Of the camera checked, where it is known: its uncertainty explains a part of the difference.

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
    fresh = solve(observations)
    if not np.isfinite(fresh.covariance).all():
        fresh = with_uncertainty(fresh)
    if not np.isfinite(fresh.covariance).all():
        said = fresh.problems[-1].message if fresh.problems else "its uncertainty is not known"
        raise CalibrationFailedError(f"no fresh solution to check against: {said}")
    range_m = _working_range(fresh)
    predicted = sigma_map(fresh, range_m).rms_px
    if covariance is not None and np.isfinite(covariance).all():
        predicted = float(np.hypot(predicted, camera_sigma_map(camera, covariance, range_m).rms_px))
    difference = compare(fresh.camera, camera, range_m=range_m)
    return Check(camera, fresh, range_m, difference, predicted, _view_rms(camera, fresh))


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
