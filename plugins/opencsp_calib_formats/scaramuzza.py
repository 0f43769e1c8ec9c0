"""Scaramuzza's omnidirectional model with a polynomial from the image to the ray, as MATLAB's fisheyeIntrinsics.

A point (u, v) of the sensor plane, relative to the distortion centre and in pixels, shows the direction::

    (u, v, a0 + a2 rho² + a3 rho³ + a4 rho⁴),  rho = sqrt(u² + v²)

Projecting is the inverse: of a ray at the angle theta to the axis, rho solves ``rho cos(theta) = f(rho) sin(theta)``.

Source: D. Scaramuzza, A. Martinelli and R. Siegwart, "A toolbox for easily calibrating omnidirectional cameras", IROS
2006; MathWorks documentation, "Fisheye Calibration Basics".
"""

import numpy as np

from opencsp_calib.arrays import Floats, Points
from opencsp_calib.models.base import inverse_radius

__all__ = ["scaramuzza"]


def scaramuzza(points: Points, mapping: Floats) -> Floats:
    """Sensor coordinates of points, before the stretch matrix.

    Parameters
    ----------
    points : (N, 3)
    mapping : a0, a2, a3, a4
        a0 in pixels, positive.

    Returns
    -------
    (N, 2) px
        NaN where the angle is beyond what the polynomial reaches before it turns back.
    """
    polynomial = np.polynomial.Polynomial([mapping[0], 0.0, *mapping[1:]])

    def angle(rho: Floats) -> Floats:
        return np.asarray(np.arctan2(rho, polynomial(rho)), dtype=np.float64)

    limit = _turning(polynomial)
    radius = np.hypot(points[:, 0], points[:, 1])
    theta = np.arctan2(radius, points[:, 2])
    with np.errstate(all="ignore"):
        rho = inverse_radius(theta, angle, limit)
        for _ in range(50):
            height, slope = polynomial(rho), polynomial.deriv()(rho)
            step = (angle(rho) - theta) * (rho * rho + height * height) / (height - rho * slope)
            rho = rho - step
            if not (np.abs(step) > 1e-12 * (1.0 + rho)).any():
                break
        reached = (np.abs(angle(rho) - theta) < 1e-9) & (rho <= limit) & (rho >= 0)
        scale = np.where(radius > 0, rho / radius, 0.0)
    scale = np.where(reached, scale, np.nan)
    return np.asarray(points[:, :2] * scale[:, None], dtype=np.float64)


def _turning(polynomial: np.polynomial.Polynomial) -> float:
    """The radius at which the angle no longer grows: where f - rho f' is 0; at most 1000 focal lengths."""
    growth = polynomial - np.polynomial.Polynomial([0.0, 1.0]) * polynomial.deriv()
    far = 1000.0 * float(polynomial.coef[0])
    roots = growth.trim().roots()
    real = roots[np.abs(roots.imag) < 1e-9 * np.abs(roots)].real
    return float(min([far, *real[real > 0]]))
