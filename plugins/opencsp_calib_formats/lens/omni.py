"""The unified omnidirectional model of Mei and Rives: onto the unit sphere, from there to a plane.

With d = |(X, Y, Z)|::

    x = X / (Z + xi d),  y = Y / (Z + xi d)

Source: C. Mei and P. Rives, "Single view point omnidirectional camera calibration from planar grids", ICRA 2007. It
is ``eucm`` with alpha = xi / (1 + xi), beta = 1 and the focal length divided by 1 + xi.
"""

import numpy as np

from opencsp_calib.arrays import Floats, Points

__all__ = ["omni"]


def omni(points: Points, xi: float) -> Floats:
    """Plane coordinates, before the model's radial and tangential distortion.

    Parameters
    ----------
    points : (N, 3)
    xi : float
        0 is perspective; above 1 more than half of the sphere is seen, up to where the image folds.

    Returns
    -------
    (N, 2)
        NaN where there is no image.
    """
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        distance = np.linalg.norm(points, axis=1)
        denominator = points[:, 2] + xi * distance
        valid = denominator > 0
        if xi > 1:
            valid &= points[:, 2] > -distance / xi
        return np.asarray(points[:, :2] / np.where(valid, denominator, np.nan)[:, None], dtype=np.float64)
