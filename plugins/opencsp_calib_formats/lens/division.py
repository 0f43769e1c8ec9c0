"""The division model: what was measured, divided by a polynomial, is undistorted.

With r' the measured radius and r the undistorted one::

    r = r' / (1 + k r'²),  so  r' = 2 r / (1 + sqrt(1 - 4 k r²))

Source: A. Fitzgibbon, "Simultaneous linear estimation of multiple view geometry and lens distortion", CVPR 2001.
"""

import numpy as np

from opencsp_calib.arrays import Floats

__all__ = ["division"]


def division(plane: Floats, k: float) -> Floats:
    """Distorted plane coordinates.

    Parameters
    ----------
    plane : (N, 2)
        Undistorted.
    k : float
        Negative for barrel distortion.

    Returns
    -------
    (N, 2)
        NaN where no measured point is undistorted to there (k positive, far out).
    """
    with np.errstate(invalid="ignore", over="ignore"):
        square = (plane**2).sum(axis=1)
        return np.asarray(2.0 * plane / (1.0 + np.sqrt(1.0 - 4.0 * k * square))[:, None], dtype=np.float64)
