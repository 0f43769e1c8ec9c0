"""Whether a solution is at the least sum of squares, and whether its observations determine it: engines do not say."""

from dataclasses import replace

import numpy as np

from opencsp_calib.calibration import Calibration
from opencsp_calib.detection import Problem
from opencsp_calib.errors import CalibrationFailedError
from opencsp_calib.normal_equations import NormalEquations, normal_equations
from opencsp_calib.schur import Factorisation, factorise

__all__ = [
    "CONVERGED_SIGMAS",
    "LEAST_SIGMA_PX",
    "OPEN_CENTRE",
    "OPEN_FOCAL",
    "determined",
    "remaining_sigmas",
    "undetermined",
]

CONVERGED_SIGMAS = 0.1  # pixels rounded to single precision, which some engines take, leave some 0.01
SMALLEST_NOISE_PX = 1e-3  # of any detector: what is found of exact pixels is judged against this
LEAST_SIGMA_PX = 0.01  # of a corner, per axis: exact corners of a bad set of views are no better set
MISFIT_PX = 5.0  # rms beyond which something else than noise is wrong
OPEN_FOCAL = 0.05  # sigma of a focal length over the focal length, above which it is as good as unknown
OPEN_CENTRE = 0.2  # sigma of the principal point over the image's longer side, likewise


def determined(calibration: Calibration) -> Calibration:
    """A solution that its observations determine, with a Problem ``not-converged`` where the engine stopped short.

    With a warp, whose unknowns are each solver's own, the board is taken as solved; by how far the engine stopped
    short is only known for equal weights and a flat or free board.

    Parameters
    ----------
    calibration : Calibration

    Raises
    ------
    CalibrationFailedError
        If the observations leave a focal length or the principal point open.
    """
    warped = calibration.options.board_shape == "warp"
    equal = replace(
        calibration.options, weights="equal", board_shape="flat" if warped else calibration.options.board_shape
    )
    equations = normal_equations(replace(calibration, options=equal))
    try:
        factor = factorise(equations)
    except np.linalg.LinAlgError:
        raise _undetermined(calibration, "camera") from None
    _check_determined(calibration, equations, factor)
    if warped or calibration.options.weights != "equal":
        return calibration
    remaining = _remaining(equations, factor, SMALLEST_NOISE_PX)
    if remaining < CONVERGED_SIGMAS:
        return calibration
    message = (
        f"{calibration.solver} ended {remaining:.2g} sigmas short of the least sum of squares, without saying so; take "
        "another solver or a simpler lens model"
    )
    return calibration.with_problems(Problem("not-converged", message))


def remaining_sigmas(calibration: Calibration) -> float:
    """How far a camera is from the least sum of squares: the length of its next Newton step, in sigmas.

    Zero where the gradient vanishes; infinite where the observations do not determine the camera. For a flat or free
    board; a warp's unknowns are each solver's own.

    Parameters
    ----------
    calibration : Calibration
        Of any solver that minimises the sum of squares that its options ask for.
    """
    equations = normal_equations(calibration)
    try:
        factor = factorise(equations)
    except np.linalg.LinAlgError:
        return np.inf
    return _remaining(equations, factor, SMALLEST_NOISE_PX if calibration.options.weights == "equal" else 0.0)


def _remaining(equations: NormalEquations, factor: Factorisation, noise_px: float) -> float:
    step = factor.step_without_poses()[: equations.unknowns.shared]
    variance = max(equations.cost / max(equations.dof, 1), noise_px**2)
    return float(np.sqrt(step @ np.linalg.solve(factor.shared_covariance, step) / variance))


def _check_determined(calibration: Calibration, equations: NormalEquations, factor: Factorisation) -> None:
    basis = equations.unknowns.camera
    cameras = basis.shape[1]
    information = basis @ factor.shared_covariance[:cameras, :cameras] @ basis.T
    noise_px = max(LEAST_SIGMA_PX, np.sqrt(equations.cost / max(equations.dof, 1)))
    sigma = noise_px * np.sqrt(np.diag(information)[:4])
    camera = calibration.camera
    if not (sigma[:2] <= OPEN_FOCAL * camera.params[:2]).all():  # NaN is not
        raise _undetermined(calibration, "focal length")
    if not (sigma[2:] <= OPEN_CENTRE * max(camera.image_size)).all():
        raise _undetermined(calibration, "principal point")


def undetermined(views: int, what: str, rms_px: float) -> CalibrationFailedError:
    """The error that so many views do not determine the camera, or what of it; with what to do.

    Parameters
    ----------
    views : int
    what : str
        Such as ``focal length``.
    rms_px : float
        Of the residuals: where it is large, something else than too few views is wrong.
    """
    cure = "take more, with the board tilted by 30 to 45 degrees in different directions, or a simpler lens model"
    if rms_px > MISFIT_PX:
        cure = f"their corners do not fit the board (rms {rms_px:.1f} px); check its description and the photographs"
    return CalibrationFailedError(f"{views} views do not determine the {what}: {cure}")


def _undetermined(calibration: Calibration, what: str) -> CalibrationFailedError:
    return undetermined(len(calibration.cam_from_board), what, calibration.rms_px)
