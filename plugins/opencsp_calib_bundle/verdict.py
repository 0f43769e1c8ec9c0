"""Whether what was found is determined by what was seen, and what a person should know about it."""

import numpy as np

from opencsp_calib import Calibration, CalibrationFailedError, Observations, Problem, SolveOptions
from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.board_shape import TURNED_DEG, roll_spread_deg
from opencsp_calib.convergence import LEAST_SIGMA_PX, OPEN_CENTRE, OPEN_FOCAL
from opencsp_calib.models import LensModel
from opencsp_calib.schur import factorise
from opencsp_calib_bundle.levenberg_marquardt import Minimum

__all__ = ["checked_covariance", "remarks"]

MANY_OUTLIERS = 0.03
MISFIT_PX = 5.0  # rms beyond which something else than noise is wrong


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


def remarks(calibration: Calibration) -> tuple[Problem, ...]:
    """What a person should know about how it was solved."""
    return (*_of_outliers(calibration), *_of_weights(calibration), *_of_board(calibration), *_of_aspect(calibration))


def _check_determined(views: int, relative: Floats, rms_px: float) -> None:
    limits = np.array([OPEN_FOCAL, OPEN_FOCAL, OPEN_CENTRE, OPEN_CENTRE])
    if (relative <= limits).all():  # NaN is not
        return
    what = "principal point" if (relative[:2] <= OPEN_FOCAL).all() else "focal length"
    cure = "take more, with the board tilted by 30 to 45 degrees in different directions, or a simpler lens model"
    if rms_px > MISFIT_PX:
        cure = f"their corners do not fit the board (rms {rms_px:.1f} px); check its description and the photographs"
    raise CalibrationFailedError(f"{views} views do not determine the {what}: {cure}")


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
