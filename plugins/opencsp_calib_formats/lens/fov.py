"""The field-of-view model: one parameter, the opening angle of an ideal fisheye.

With r the radius on the plane at unit distance::

    r' = atan(2 r tan(w / 2)) / w

Source: F. Devernay and O. Faugeras, "Straight lines have to be straight", Machine Vision and Applications 13, 2001.
"""

import numpy as np

from opencsp_calib.arrays import Floats

__all__ = ["fov"]


def fov(plane: Floats, w: float) -> Floats:
    """Distorted plane coordinates.

    Parameters
    ----------
    plane : (N, 2)
        Undistorted.
    w : float
        Radians, between -pi and pi; 0 is no distortion.

    Returns
    -------
    (N, 2)
        For every point of the plane: the model images all that is before the camera.
    """
    if w == 0.0:
        return plane
    radius = np.hypot(plane[:, 0], plane[:, 1])
    stretch = 2.0 * np.tan(w / 2.0)
    centre = stretch / w
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.where(radius * stretch < 1e-9, centre, np.arctan(radius * stretch) / (radius * w))
    return np.asarray(plane * scale[:, None], dtype=np.float64)
