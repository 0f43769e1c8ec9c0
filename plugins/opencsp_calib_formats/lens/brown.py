"""Brown's distortion with any number of radial terms.

With r2 = x² + y², and p1, p2 in OpenCV's meaning::

    radial = 1 + k1 r2 + k2 r2² + k3 r2³ + ...
    growth = 1 + p3 r2 + p4 r2² + ...
    x' = x radial + (2 p1 x y + p2 (r2 + 2 x²)) growth + s1 r2 + s2 r2²
    y' = y radial + (p1 (r2 + 2 y²) + 2 p2 x y) growth + s3 r2 + s4 r2²

Source: D. C. Brown, "Close-range camera calibration", Photogrammetric Engineering 37, 1971; the growth of the
tangential terms as in the Agisoft Metashape manual, appendix "Camera models"; s1 to s4 as in OpenCV.
"""

from collections.abc import Sequence

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.models.base import smallest_positive_root

__all__ = ["brown", "brown_with_jacobian", "fold"]


def brown(
    plane: Floats, radial: Sequence[float], tangential: Sequence[float] = (), prism: Sequence[float] = ()
) -> Floats:
    """Distorted plane coordinates.

    Parameters
    ----------
    plane : (N, 2)
        Undistorted: of a perspective camera, or of a fisheye.
    radial : k1, k2, ...
        As many as there are.
    tangential : p1, p2[, p3, p4, ...]
        In OpenCV's meaning; p3 and p4 are Metashape's.
    prism : s1, s2, s3, s4

    Returns
    -------
    (N, 2)
        NaN beyond the radius at which the radial polynomial folds back.
    """
    return brown_with_jacobian(plane, radial, tangential, prism)[0]


def fold(radial: Sequence[float]) -> float:
    """The radius at which ``r (1 + k1 r² + ...)`` stops growing; infinite if it never does."""
    slope = [1.0] + [(2 * i + 3) * k for i, k in enumerate(radial)]  # in r²
    return float(np.sqrt(smallest_positive_root(np.array(slope))))


def brown_with_jacobian(
    plane: Floats, radial: Sequence[float], tangential: Sequence[float] = (), prism: Sequence[float] = ()
) -> tuple[Floats, Floats]:
    """The same as `brown`, with its derivative (N, 2, 2) by the plane's coordinates."""
    p1, p2, *further = (*tangential, 0.0, 0.0)[: max(2, len(tangential))]
    s1, s2, s3, s4 = prism if len(prism) else (0.0, 0.0, 0.0, 0.0)
    with np.errstate(invalid="ignore", over="ignore"):
        x, y = plane.T
        r2 = x * x + y * y
        r2 = np.where(r2 <= fold(radial) ** 2, r2, np.nan)
        factor, factor_slope = _series(radial, r2)
        growth, growth_slope = _series(further, r2)
        decentring = np.array([2 * p1 * x * y + p2 * (r2 + 2 * x * x), p1 * (r2 + 2 * y * y) + 2 * p2 * x * y])
        shift = np.array([r2 * (s1 + s2 * r2), r2 * (s3 + s4 * r2)])
        shift_slope = np.array([s1 + 2 * s2 * r2, s3 + 2 * s4 * r2])
        bent = np.array([x, y]) * factor + decentring * growth + shift
        by_r2 = np.array([x, y]) * factor_slope + decentring * growth_slope + shift_slope
        cross = 2 * (p1 * x + p2 * y) * growth
        jacobian = by_r2.T[:, :, None] * (2 * plane)[:, None, :]
        jacobian[:, 0, 0] += factor + (2 * p1 * y + 6 * p2 * x) * growth
        jacobian[:, 0, 1] += cross
        jacobian[:, 1, 0] += cross
        jacobian[:, 1, 1] += factor + (6 * p1 * y + 2 * p2 * x) * growth
    return bent.T, jacobian


def _series(coefficients: Sequence[float], r2: Floats) -> tuple[Floats, Floats]:
    """1 + c1 r2 + c2 r2² + ..., and its derivative by r2."""
    polynomial = np.polynomial.Polynomial([1.0, *coefficients])
    return np.asarray(polynomial(r2)), np.asarray(polynomial.deriv()(r2)) * np.ones_like(r2)
