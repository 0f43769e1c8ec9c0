"""Kannala and Brandt's fisheye model as OpenCV has it.

With r = sqrt(X² + Y²) and theta = atan2(r, Z)::

    theta_d = theta (1 + k1 theta² + k2 theta⁴ + k3 theta⁶ + k4 theta⁸)
    u = fx theta_d X / r + cx,  v = fy theta_d Y / r + cy

Source: OpenCV documentation, module calib3d, "Fisheye camera model"; Kannala and Brandt, "A generic camera model and
calibration method for conventional, wide-angle, and fish-eye lenses", PAMI 2006. Unlike OpenCV's code, which divides
by Z, this is right for points beside and behind the camera too.
"""

import numpy as np

from opencsp_calib.arrays import Floats, Params, Points
from opencsp_calib.models.base import LensModel, inverse_radius, smallest_positive_root

__all__ = ["FisheyeModel"]

POWERS = np.array([3, 5, 7, 9])
NEAR_AXIS = 1e-4  # r/Z below which the series about the axis is exact in double precision


class FisheyeModel(LensModel):
    """OpenCV's fisheye model with four coefficients."""

    name = "opencv_fisheye"
    distortion_names = ("k1", "k2", "k3", "k4")

    def valid_radius(self, distortion: Params) -> float:
        """See `LensModel.valid_radius`: the angle at which theta_d stops growing, at most pi."""
        slope = np.concatenate([[1.0], POWERS * distortion])  # in theta²
        return float(min(np.pi, np.sqrt(smallest_positive_root(slope))))

    def max_angle(self, distortion: Params) -> float:
        """See `LensModel.max_angle`."""
        return self.valid_radius(distortion)

    def _distorted(self, points: Points, distortion: Params) -> Floats:
        scale, _, _ = self._scale(points, distortion)
        return points[:, :2] * scale[:, None]

    def _distorted_with_jacobians(self, points: Points, distortion: Params) -> tuple[Floats, Floats, Floats]:
        scale, theta, r = self._scale(points, distortion)
        xy, z = points[:, :2], points[:, 2]
        square = r * r + z * z
        slope = _theta_d_slope(theta, distortion)
        with np.errstate(divide="ignore", invalid="ignore"):
            by_r_over_r = (slope * z / square - scale) / (r * r)
            by_r_over_r = np.where(r < NEAR_AXIS * z, 2.0 * (distortion[0] - 1.0 / 3.0) / z**3, by_r_over_r)
            direction = np.where(r[:, None] > 0, xy / r[:, None], 0.0)
        by_point = np.empty((2, 3, len(points))).transpose(2, 0, 1)
        by_point[:, :, :2] = xy[:, :, None] * xy[:, None, :] * by_r_over_r[:, None, None]
        by_point[:, 0, 0] += scale
        by_point[:, 1, 1] += scale
        by_point[:, :, 2] = -xy * (slope / square)[:, None]
        by_distortion = direction[:, :, None] * (theta[:, None] ** POWERS)[:, None, :]
        return xy * scale[:, None], by_point, by_distortion

    def _undistorted(self, plane: Floats, distortion: Params, tolerance: float) -> Points:
        distorted = np.hypot(plane[:, 0], plane[:, 1])
        limit = self.valid_radius(distortion)
        plain = not distortion.any()  # where solvers start: dozens of times, with focal lengths to choose from
        theta = distorted if plain else inverse_radius(distorted, lambda t: _theta_d(t, distortion), limit)
        with np.errstate(all="ignore"):
            for _ in range(50):
                error = _theta_d(theta, distortion) - distorted
                if not (np.abs(error) > 0.1 * tolerance).any():
                    break
                theta = theta - error / _theta_d_slope(theta, distortion)
            lost = ~(np.abs(_theta_d(theta, distortion) - distorted) <= tolerance) | (theta > limit)
            theta[lost] = np.nan
            scale = np.where(distorted > 0, np.sin(theta) / distorted, 1.0)
        return np.column_stack([plane * scale[:, None], np.cos(theta)])

    def _scale(self, points: Points, distortion: Params) -> tuple[Floats, Floats, Floats]:
        """theta_d / r, theta and r; NaN where there is no image."""
        r, z = np.hypot(points[:, 0], points[:, 1]), points[:, 2]
        theta = np.arctan2(r, z)
        theta = np.where((theta > self.valid_radius(distortion)) | ((r == 0) & (z <= 0)), np.nan, theta)
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = np.where(r < NEAR_AXIS * z, (1.0 - (r / z) ** 2 / 3.0) / z, theta / r)
            scale = np.where(np.isnan(theta), np.nan, ratio * _theta_d_factor(theta, distortion))
        return scale, theta, r


def _theta_d_factor(theta: Floats, k: Params) -> Floats:
    square = theta * theta
    return np.asarray(1.0 + square * (k[0] + square * (k[1] + square * (k[2] + square * k[3]))), dtype=np.float64)


def _theta_d(theta: Floats, k: Params) -> Floats:
    return theta * _theta_d_factor(theta, k)


def _theta_d_slope(theta: Floats, k: Params) -> Floats:
    square = theta * theta
    polynomial = square * (3 * k[0] + square * (5 * k[1] + square * (7 * k[2] + square * 9 * k[3])))
    return np.asarray(1.0 + polynomial, dtype=np.float64)
