"""The plane at unit distance before the camera, and from there to pixels."""

import numpy as np

from opencsp_calib.arrays import Floats, Pixels, Points

__all__ = ["on_plane", "to_pixels"]


def on_plane(points: Points) -> Floats:
    """(N, 2) x/z, y/z of points (N, 3); NaN beside and behind the camera."""
    z = points[:, 2]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return np.asarray(points[:, :2] / np.where(z > 0, z, np.nan)[:, None], dtype=np.float64)


def to_pixels(plane: Floats, fx: float, fy: float, cx: float, cy: float, skew: float = 0.0) -> Pixels:
    """``u = fx x + skew y + cx, v = fy y + cy``.

    Parameters
    ----------
    plane : (N, 2)
    fx, fy, cx, cy, skew : float
        Pixels.
    """
    x, y = plane.T
    return np.column_stack([fx * x + skew * y + cx, fy * y + cy])
