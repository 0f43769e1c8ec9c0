"""The two fisheye projections that programs distort further: equidistant and equisolid.

With r = sqrt(X² + Y²) and theta = atan2(r, Z)::

    equidistant: x = theta X / r,          y = theta Y / r
    equisolid:   x = 2 sin(theta/2) X / r, y = 2 sin(theta/2) Y / r
"""

from collections.abc import Callable

import numpy as np

from opencsp_calib.arrays import Floats, Points

__all__ = ["equidistant", "equisolid"]


def equidistant(points: Points) -> Floats:
    """(N, 2) of points (N, 3): their length is the angle to the axis, radians; NaN straight behind the camera."""
    return _along_radius(points, lambda theta: theta)


def equisolid(points: Points) -> Floats:
    """(N, 2) of points (N, 3): their length is twice the sine of half the angle to the axis; NaN straight behind."""
    return _along_radius(points, lambda theta: 2.0 * np.sin(theta / 2.0))


def _along_radius(points: Points, length: Callable[[Floats], Floats]) -> Floats:
    radius = np.hypot(points[:, 0], points[:, 1])
    theta = np.arctan2(radius, points[:, 2])
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = length(theta) / radius
        scale = np.where((radius == 0) & (points[:, 2] > 0), 1.0 / points[:, 2], scale)
        return np.asarray(points[:, :2] * scale[:, None], dtype=np.float64)
