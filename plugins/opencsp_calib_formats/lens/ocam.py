"""Scaramuzza's omnidirectional model by its inverse polynomial, as camodocal and the OCamCalib toolbox project with it.

With r = sqrt(X² + Y²) and t = atan2(-Z, r), which is -pi/2 on the axis::

    rho = c0 + c1 t + c2 t² + ...
    x = rho X / r,  y = rho Y / r

in pixels; an affine map follows. Source: D. Scaramuzza, A. Martinelli and R. Siegwart, "A toolbox for easily
calibrating omnidirectional cameras", IROS 2006; function world2cam of the toolbox.
"""

from collections.abc import Sequence

import numpy as np

from opencsp_calib.arrays import Floats, Points

__all__ = ["ocam"]


def ocam(points: Points, inverse_polynomial: Sequence[float]) -> Floats:
    """Coordinates in pixels, relative to the centre, before the affine map.

    Parameters
    ----------
    points : (N, 3)
    inverse_polynomial : c0, c1, ...

    Returns
    -------
    (N, 2) px
        NaN where the polynomial, which holds only where it was fitted, does not grow or is negative.
    """
    radius = np.hypot(points[:, 0], points[:, 1])
    angle = np.arctan2(-points[:, 2], radius)
    polynomial = np.polynomial.Polynomial(list(inverse_polynomial))
    length, slope = np.asarray(polynomial(angle)), np.asarray(polynomial.deriv()(angle))
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where((slope > 0) & (length >= 0) & (radius > 0), length / radius, np.nan)
        found = np.asarray(points[:, :2] * scale[:, None], dtype=np.float64)
    found[(radius == 0) & (points[:, 2] > 0)] = 0.0
    return found
