"""What the tests of camera formats hold against the readers: directions, and OpenCV's own projection of them."""

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = ["agree", "directions", "opencv", "opencv_fisheye", "perspective"]

Array = NDArray[np.float64]


def directions(max_deg: float = 35.0) -> Array:
    """(N, 3) unit vectors evenly over a cone about the axis, the axis among them."""
    theta, phi = np.meshgrid(np.radians(np.linspace(0, max_deg, 30)), np.linspace(0, 2 * np.pi, 24, endpoint=False))
    sine = np.sin(theta)
    return np.stack([sine * np.cos(phi), sine * np.sin(phi), np.cos(theta)], axis=-1).reshape(-1, 3)


def perspective(points: Array) -> tuple[Array, Array]:
    """X = X/Z and y = Y/Z."""
    return points[:, 0] / points[:, 2], points[:, 1] / points[:, 2]


def opencv(points: Array, intrinsics: ArrayLike, coefficients: ArrayLike = ()) -> Array:
    """cv2's projection; intrinsics are fx, fy, cx, cy."""
    fx, fy, cx, cy = np.asarray(intrinsics, dtype=float)
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), matrix, np.array(coefficients, dtype=float))
    return pixels[:, 0]


def opencv_fisheye(points: Array, intrinsics: ArrayLike, coefficients: ArrayLike) -> Array:
    """cv2's fisheye projection."""
    fx, fy, cx, cy = np.asarray(intrinsics, dtype=float)
    matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    pixels, _ = cv2.fisheye.projectPoints(
        points[:, None], np.zeros(3), np.zeros(3), matrix, np.array(coefficients, dtype=float)
    )
    return pixels[:, 0]


def agree(ours: Array, theirs: Array, tolerance_px: float = 1e-9) -> None:
    """Fail where pixels differ, or most have no image."""
    seen = np.isfinite(ours).all(axis=1)
    assert seen.mean() > 0.6
    np.testing.assert_allclose(ours[seen], theirs[seen], rtol=0, atol=tolerance_px)
