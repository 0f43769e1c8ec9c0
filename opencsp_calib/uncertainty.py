"""How far to trust a calibration: of the parameters, of every projection, and by each view alone.

Two estimates, for any solver's result, from the normal equations at its solution with poses and board marginalised:

*residual*   the inverse information times the variance of the residuals: right if they are independent. They are not:
             neighbouring corners share their errors, boards flex, and it is too small by up to 20 times on real sets.
*jackknife*  how the camera moves when each view in turn is left out, ``(V - 1)/V sum (d - mean)(d - mean)'``: a view
             may be wrong as a whole, in any way. It has about V - 1 degrees of freedom: 95 % of the truth lies within
             Student's t of that many, times sigma (`student_factor`). In the literature of clustered errors this is
             CV3 (Bell and McCaffrey 2002; MacKinnon, Nielsen and Webb 2023). Where views are few and of unequal
             weight it takes another number of sigmas than Student's t: `opencsp_calib.leverage` makes up for that.

The honest one, which is shown, saved and used in verdicts, is the jackknife. Only where it is below the residual one on
the whole, in the mean of all directions of parameter space, what it lacks is added as a part of that: few views, or
exact ones, may all agree by chance. (The larger of the two in every direction would be a third too
large with 10 views of ideal noise: each direction that chance has made small would be raised, and none lowered.)

A projection's uncertainty is what is left after the change of frame that `compare` fits is projected out.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from opencsp_calib.arrays import Floats, Matrix, Params
from opencsp_calib.calibration import Calibration
from opencsp_calib.detection import Problem
from opencsp_calib.errors import CalibrationFailedError
from opencsp_calib.leaving_out import camera_without_each_view
from opencsp_calib.leverage import jackknife_correction
from opencsp_calib.normal_equations import normal_equations
from opencsp_calib.projection_sigma import Alignment, projection_sigma, ray_sigma, sigma_map, sigma_over_range
from opencsp_calib.quality import range_of
from opencsp_calib.schur import Factorisation, factorise

__all__ = [
    "UNKNOWN",
    "Influence",
    "honest_covariance",
    "influence",
    "jackknife_covariance",
    "projection_sigma",
    "ray_sigma",
    "sigma_map",
    "sigma_over_range",
    "student_factor",
    "with_uncertainty",
]

UNKNOWN = frozenset({"undetermined", "uncertainty-unknown"})
"""Codes of problems that say: not even how far the camera is off can be told, or it may be off by anything."""
ROUNDING = 1e-9  # px (or sigmas, where corners are weighted): what is left of exact corners tells nothing
NOTICEABLE_PX = 0.01  # no corner is located better: a camera that moves by less has not moved for anybody
OPEN = 0.01  # of the image's longer side: a camera known no better is as good as unknown
MIN_VIEWS = 3  # with two views, leaving one out leaves nothing to compare


@dataclass(frozen=True, eq=False)
class Influence:
    """How far one view alone moves the camera.

    Parameters
    ----------
    image : str
    rms_px : float
        Of the view's residuals: it may be unremarkable where the influence is not.
    params : (P,)
        The camera's parameters with this view left out, minus those with it.
    shift_rms_px, shift_worst_px : float
        How far projections move over the image when it is left out, after aligning the frames.
    share : float
        Of the jackknife variance of projections over the image: 1/V each where all views count the same.
    """

    image: str
    rms_px: float
    params: Params = field(repr=False)
    shift_rms_px: float
    shift_worst_px: float
    share: float


def with_uncertainty(calibration: Calibration) -> Calibration:
    """The calibration with its covariances filled in, and with what there is to say about them.

    One whose honest covariance is known, or is known not to be, is returned as it is.

    Returns
    -------
    Calibration
        `covariance` is the honest one. Both are NaN, and a `Problem` says so, where the views do not determine the
        camera, or would not without one of them. Another is there where they hardly do, with covariances that tell by
        how much; and one that names a view on which the result hangs.
    """
    if np.isfinite(calibration.covariance).all() or {p.code for p in calibration.problems} & UNKNOWN:
        return calibration
    try:
        residual, steps, factor = _linearised(calibration)
    except np.linalg.LinAlgError as error:
        message = f"the views do not determine the camera ({error}): take more of them, from different directions"
        return calibration.with_problems(Problem("undetermined", message))
    calibration = replace(calibration, covariance_residual=residual)
    unknown = _why_unknown(calibration, steps)
    if unknown:
        return calibration.with_problems(unknown)
    jackknife = jackknife_correction(factor) ** 2 * jackknife_covariance(steps)
    honest = honest_covariance(residual, jackknife, factor.equations.unknowns.camera)
    calibration = replace(calibration, covariance=honest)
    jacobian = Alignment.at_infinity(calibration.camera).grid_jacobian
    hangs = _hangs_on(calibration, _influence(calibration, steps, jacobian), jacobian)
    return calibration.with_problems(*_open_still(calibration, jacobian), *hangs)


def _linearised(calibration: Calibration) -> tuple[Matrix, Floats, Factorisation]:
    """Covariance by the residuals (P, P), steps without each view (V, P), and what both are from."""
    equations = normal_equations(calibration)
    if equations.dof <= 0:
        raise np.linalg.LinAlgError("no more observations than unknowns")
    factor = factorise(equations)
    residual = factor.camera_covariance * max(equations.cost / equations.dof, ROUNDING**2)
    return residual, camera_without_each_view(factor), factor


def influence(calibration: Calibration) -> tuple[Influence, ...]:
    """How far each used view alone moves the camera, in order of capture.

    One Newton step a view, everything else solved again; NaN where the others do not determine the camera.

    Raises
    ------
    CalibrationFailedError
        If all views together do not determine it.
    """
    try:
        steps = camera_without_each_view(factorise(normal_equations(calibration)))
    except np.linalg.LinAlgError as error:
        raise CalibrationFailedError(
            f"no influence of views: together they do not determine the camera ({error})"
        ) from None
    return _influence(calibration, steps, Alignment.at_infinity(calibration.camera).grid_jacobian)


def student_factor(views: int, confidence: float = 0.95) -> float:
    """How many honest sigmas to each side hold the truth with this confidence: Student's t of views - 1 degrees."""
    from scipy.special import stdtrit

    return float(stdtrit(views - 1, 0.5 + 0.5 * confidence))


def jackknife_covariance(steps: Floats) -> Matrix:
    """(P, P) from how the parameters move when each view in turn is left out, (V, P)."""
    spread = steps - steps.mean(axis=0)
    return np.asarray((len(steps) - 1) / len(steps) * spread.T @ spread)


def honest_covariance(residual: Matrix, jackknife: Matrix, basis: Matrix) -> Matrix:
    """(P, P) the jackknife, and as much of the residual one as it is smaller in the mean of all directions, if it is.

    Parameters
    ----------
    residual, jackknife : (P, P)
        The first positive definite within the span of the basis, the second maybe singular.
    basis : (P, Q)
        What the parameters may do: fewer columns than rows where fy/fx is held.
    """
    inverse = np.linalg.pinv(basis)
    first, second = (inverse @ covariance @ inverse.T for covariance in (residual, jackknife))
    scale = 1.0 / np.sqrt(np.diag(first))  # focal lengths and coefficients differ by orders of magnitude
    ratio = np.trace(np.linalg.solve(scale[:, None] * first * scale, scale[:, None] * second * scale)) / len(scale)
    return np.asarray(jackknife + max(0.0, 1.0 - ratio) * residual)


def _why_unknown(calibration: Calibration, steps: Floats) -> Problem | None:
    images = [view.image for view in calibration.observations.used]
    alone = [image for image, step in zip(images, steps, strict=True) if not np.isfinite(step).all()]
    if len(images) >= MIN_VIEWS and not alone:
        return None
    why = f"without {', '.join(alone)} the others do not determine the camera" if alone else "there are only two views"
    message = f"the uncertainty cannot be told from the views' agreement, because {why}: take more views"
    return Problem("uncertainty-unknown", message)


def _influence(calibration: Calibration, steps: Floats, jacobian: Floats) -> tuple[Influence, ...]:
    moved = (((jacobian @ step) ** 2).sum(axis=1) for step in steps)  # (N,) px² of one view after the other
    squares, worst_squares = np.array([(square.mean(), square.max()) for square in moved]).T
    total = squares.sum()
    return tuple(
        Influence(view.image, float(rms), step, float(np.sqrt(square)), float(worst), float(square / (total or 1.0)))
        for view, rms, step, square, worst in zip(
            calibration.observations.used, calibration.view_rms_px, steps, squares, np.sqrt(worst_squares), strict=True
        )
    )


def _open_still(calibration: Calibration, jacobian: Floats) -> tuple[Problem, ...]:
    """Said where the honest sigma is so large that the camera is as good as unknown, however small the residuals."""
    sigma_px = _mean_variance_px2(jacobian, calibration.covariance) ** 0.5
    if sigma_px <= OPEN * max(calibration.camera.image_size):
        return ()
    message = (
        f"the views do not determine the camera: over the image, what it sees is known to {sigma_px:.2g} px only; take "
        "more of them, from different directions, or a simpler lens model"
    )
    return (Problem("undetermined", message),)


def _mean_variance_px2(jacobian: Floats, covariance: Matrix) -> float:
    """Of projections over the image, from (N, 2, P) derivatives by the parameters."""
    return float(np.einsum("nij,jk,nik->n", jacobian, covariance, jacobian).mean())


def _hangs_on(calibration: Calibration, influences: tuple[Influence, ...], jacobian: Floats) -> tuple[Problem, ...]:
    """A view that moves the camera farther than all others together, and farther than the residuals explain.

    More than half of the jackknife variance is then one number squared: it has hardly more than one degree of
    freedom, whatever the number of views, so that even the honest sigma cannot be relied on.
    """
    most = max(influences, key=lambda i: i.share)
    explained = _mean_variance_px2(jacobian, calibration.covariance_residual)
    if not (most.share > 0.5 and most.shift_rms_px**2 > explained and most.shift_rms_px > NOTICEABLE_PX):
        return ()
    message = (
        f"this result hangs on {most.image}: left out, it moves what the camera sees by {most.shift_rms_px:.2g} px rms "
        f"({most.shift_worst_px:.2g} at worst), farther than all other views together; take more views like it, "
        f"{_place(calibration, most.image)}, or, if something is wrong with it, drop it"
    )
    return (Problem("hangs-on-view", message),)


def _place(calibration: Calibration, image: str) -> str:
    index = [view.image for view in calibration.observations.used].index(image)
    pose = calibration.cam_from_board[index]
    return f"with the board {range_of(calibration.board, pose):.2f} m away and tilted by {pose.tilt_deg:.0f} degrees"
