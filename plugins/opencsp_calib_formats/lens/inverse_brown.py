"""Brown's distortion the other way round: the polynomial takes measured to undistorted coordinates.

Photogrammetry (Australis, PhotoModeler, HALCON's polynomial model, ASP's BrownConrady) corrects what was measured, with
the same polynomial as in `brown`; to project, it has to be solved.
"""

from collections.abc import Sequence

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.models.base import inverse_radius
from opencsp_calib_formats.lens.brown import brown_with_jacobian, fold

__all__ = ["INVERSE", "inverse_brown"]

INVERSE = "it corrects what was measured; our models distort what is seen"
"""Why such a model is none of ours, for messages."""

CONVERGED = 1e-14  # of plane coordinates: far below 1e-9 px at any focal length
FAR = 1e3  # of plane coordinates: nothing is imaged there


def inverse_brown(plane: Floats, radial: Sequence[float], tangential: Sequence[float] = ()) -> Floats:
    """Plane coordinates that ``brown`` takes to the given ones.

    Parameters
    ----------
    plane : (N, 2)
        Undistorted.
    radial, tangential
        As for `brown`, of the polynomial that corrects.

    Returns
    -------
    (N, 2)
        NaN where no coordinates within the fold of the polynomial are taken there.
    """
    target = np.hypot(plane[:, 0], plane[:, 1])
    polynomial = np.polynomial.Polynomial([0.0, *(c for k in (1.0, *radial) for c in (k, 0.0))])
    limit = fold(radial)
    limit = limit if limit < FAR else np.inf  # bisection from a limit that is next to infinite would not get near
    with np.errstate(all="ignore"):
        radius = inverse_radius(np.nan_to_num(target), lambda r: np.asarray(polynomial(r)), limit)
        scale = np.divide(radius, target, out=np.ones_like(radius), where=target > 0)
        found = np.asarray(plane * scale[:, None], dtype=np.float64)
        for _ in range(50):
            bent, jacobian = brown_with_jacobian(found, radial, tangential)
            error = bent - plane
            if not (np.abs(error) > CONVERGED).any():
                break
            found = found - _solved(jacobian, error)
        error = brown_with_jacobian(found, radial, tangential)[0] - plane
        size = 1.0 + np.abs(plane).max(axis=1)
        found[~(np.abs(error).max(axis=1) <= 1e3 * CONVERGED * size)] = np.nan
    return found


def _solved(jacobian: Floats, error: Floats) -> Floats:
    (a, b), (c, d) = np.moveaxis(jacobian, 0, -1)
    step = np.column_stack([d * error[:, 0] - b * error[:, 1], a * error[:, 1] - c * error[:, 0]])
    return np.asarray(step / (a * d - b * c)[:, None], dtype=np.float64)
