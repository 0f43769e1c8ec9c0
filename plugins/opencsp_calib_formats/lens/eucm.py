"""The enhanced unified camera model: onto an ellipsoid, from there to a plane.

With d = sqrt(beta (X² + Y²) + Z²)::

    x = X / (alpha d + (1 - alpha) Z),  y = Y / (alpha d + (1 - alpha) Z)

Source: B. Khomutenko, G. Garcia and P. Martinet, "An enhanced unified camera model", RA-L 2016; where it is valid:
V. Usenko, N. Demmel and D. Cremers, "The double sphere camera model", 3DV 2018. The unified camera model is this with
beta = 1.
"""

import numpy as np

from opencsp_calib.arrays import Floats, Points

__all__ = ["eucm"]


def eucm(points: Points, alpha: float, beta: float) -> Floats:
    """Plane coordinates.

    Parameters
    ----------
    points : (N, 3)
    alpha : float
        0 to 1.
    beta : float
        Positive.

    Returns
    -------
    (N, 2)
        NaN where there is no image.
    """
    z = points[:, 2]
    lowest = alpha / (1.0 - alpha) if alpha <= 0.5 else (1.0 - alpha) / alpha
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        distance = np.sqrt(beta * (points[:, :2] ** 2).sum(axis=1) + z * z)
        denominator = alpha * distance + (1.0 - alpha) * z
        valid = (z > -lowest * distance) & (denominator > 0)
        return np.asarray(points[:, :2] / np.where(valid, denominator, np.nan)[:, None], dtype=np.float64)
