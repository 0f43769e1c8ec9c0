"""The covariance of what was found, where the views determine it and the iteration has converged."""

import numpy as np

from opencsp_calib import CalibrationFailedError, Observations, SolveOptions
from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.convergence import LEAST_SIGMA_PX, OPEN_CENTRE, OPEN_FOCAL, undetermined
from opencsp_calib.models import LensModel
from opencsp_calib.schur import factorise
from opencsp_calib_bundle.levenberg_marquardt import Minimum

__all__ = ["checked_covariance"]


def checked_covariance(
    observations: Observations, lens: LensModel, options: SolveOptions, minimum: Minimum, typical_weight: float
) -> Matrix:
    """(P, P) covariance of the camera's parameters as the residuals have it.

    Parameters
    ----------
    observations, lens, options
        What was asked for.
    minimum : Minimum
    typical_weight : float
        See `CornerTable.typical_weight`.

    Raises
    ------
    CalibrationFailedError
        If there are more unknowns than numbers, the views do not determine the camera, or the iteration did not
        converge.
    """
    equations = minimum.equations
    if equations.dof <= 0:
        unknowns = equations.numbers - equations.dof
        raise CalibrationFailedError(
            f"{equations.numbers // 2} corners are too few for the {unknowns} unknowns of {lens.name!r} with a "
            f"{options.board_shape} board: take more views"
        )
    try:
        information = (minimum.factor or factorise(equations)).camera_covariance
    except np.linalg.LinAlgError:
        information = np.full((len(lens.parameter_names),) * 2, np.inf)
    floor = LEAST_SIGMA_PX * typical_weight
    with np.errstate(invalid="ignore"):
        sigma = np.sqrt(np.diag(information)) * max(floor, (equations.cost / equations.dof) ** 0.5)
    params = minimum.estimate.params
    relative = np.concatenate([sigma[:2] / params[:2], sigma[2:4] / max(observations.image_size)])
    rms_px = (equations.cost / equations.numbers * 2.0) ** 0.5 / typical_weight
    _check_determined(len(observations.used), relative, rms_px)
    if not minimum.converged:
        raise CalibrationFailedError(
            f"the solution of {lens.name!r} did not converge: the views do not tell its coefficients apart, or it "
            "folds back at the outermost corners; take a simpler lens model, or more views"
        )
    return information * equations.cost / equations.dof


def _check_determined(views: int, relative: Floats, rms_px: float) -> None:
    limits = np.array([OPEN_FOCAL, OPEN_FOCAL, OPEN_CENTRE, OPEN_CENTRE])
    if (relative <= limits).all():  # NaN is not
        return
    raise undetermined(views, "principal point" if (relative[:2] <= OPEN_FOCAL).all() else "focal length", rms_px)
