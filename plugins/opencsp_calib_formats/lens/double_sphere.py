"""The double sphere model: onto a unit sphere, onto a second one shifted by xi, from there to a plane.

With d1 = |(X, Y, Z)| and d2 = |(X, Y, xi d1 + Z)|::

    x = X / (alpha d2 + (1 - alpha) (xi d1 + Z)),  y likewise

Source: V. Usenko, N. Demmel and D. Cremers, "The double sphere camera model", 3DV 2018, equations 40 to 45.
"""

import numpy as np

from opencsp_calib.arrays import Floats, Points

__all__ = ["double_sphere"]


def double_sphere(points: Points, xi: float, alpha: float) -> Floats:
    """Plane coordinates.

    Parameters
    ----------
    points : (N, 3)
    xi : float
        Above -1.
    alpha : float
        0 to 1.

    Returns
    -------
    (N, 2)
        NaN where there is no image.
    """
    w1 = alpha / (1.0 - alpha) if alpha <= 0.5 else (1.0 - alpha) / alpha
    w2 = (w1 + xi) / np.sqrt(2.0 * w1 * xi + xi * xi + 1.0)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        first = np.linalg.norm(points, axis=1)
        shifted = xi * first + points[:, 2]
        second = np.sqrt((points[:, :2] ** 2).sum(axis=1) + shifted**2)
        denominator = alpha * second + (1.0 - alpha) * shifted
        valid = (points[:, 2] > -w2 * first) & (denominator > 0)
        return np.asarray(points[:, :2] / np.where(valid, denominator, np.nan)[:, None], dtype=np.float64)
