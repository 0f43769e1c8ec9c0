"""The Brown-Conrady model with OpenCV's rational, thin-prism and tilt terms; with fewer coefficients, the lesser ones.

With x = X/Z, y = Y/Z and r2 = x² + y²::

    radial = (1 + k1 r2 + k2 r2² + k3 r2³) / (1 + k4 r2 + k5 r2² + k6 r2³)
    x' = x radial + 2 p1 x y + p2 (r2 + 2 x²) + s1 r2 + s2 r2²
    y' = y radial + p1 (r2 + 2 y²) + 2 p2 x y + s3 r2 + s4 r2²
    (x', y') tilted by tau_x, tau_y (see `tilt.py`)
    u = fx x' + cx,  v = fy y' + cy

Source: OpenCV documentation, module calib3d, "Detailed Description".
"""

from functools import lru_cache

import numpy as np

from opencsp_calib.arrays import Floats, Params, Points
from opencsp_calib.models.base import LensModel, inverse_radius, smallest_positive_root
from opencsp_calib.models.tilt import tilt_jacobian, tilt_matrix, tilted

__all__ = ["OpenCVModel"]

NAMES = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tau_x", "tau_y")


class OpenCVModel(LensModel):
    """OpenCV's model with the first 0, 4, 5, 8, 12 or 14 of its coefficients.

    Parameters
    ----------
    name : str
    coefficients : int
        How many distortion coefficients it has.
    """

    def __init__(self, name: str, coefficients: int) -> None:
        self.name = name
        self.distortion_names = NAMES[:coefficients]

    def valid_radius(self, distortion: Params) -> float:
        """See `LensModel.valid_radius`; the tangential, prism and tilt terms, which are small, are left out."""
        k1, k2, _, _, k3, k4, k5, k6 = _padded(distortion)[:8].tolist()
        return _fold((1.0, k1, k2, k3), (1.0, k4, k5, k6))

    def max_angle(self, distortion: Params) -> float:
        """See `LensModel.max_angle`; always below a right angle."""
        return float(np.arctan(self.valid_radius(distortion)))

    def _distorted(self, points: Points, distortion: Params) -> Floats:
        d = _padded(distortion)
        bent = _bent(self._on_plane(points, distortion), d)
        return tilted(bent, tilt_matrix(d[12], d[13])) if len(distortion) == len(NAMES) else bent

    def _distorted_with_jacobians(self, points: Points, distortion: Params) -> tuple[Floats, Floats, Floats]:
        d = _padded(distortion)
        plane = self._on_plane(points, distortion)
        bent = _bent(plane, d)
        by_plane, by_coefficients = _bent_jacobians(plane, d, len(distortion))
        if len(distortion) == len(NAMES):
            by_bent, by_tilt = tilt_jacobian(bent, d[12], d[13])
            bent = tilted(bent, tilt_matrix(d[12], d[13]))
            by_plane = by_bent @ by_plane
            by_coefficients = by_bent @ by_coefficients
            by_coefficients[:, :, 12:] = by_tilt
        by_point = np.empty((2, 3, len(points))).transpose(2, 0, 1)
        np.divide(by_plane, points[:, 2, None, None], out=by_point[:, :, :2])
        by_point[:, :, 2] = -by_point[:, :, 0] * plane[:, :1] - by_point[:, :, 1] * plane[:, 1:]
        return bent, by_point, by_coefficients

    def _undistorted(self, plane: Floats, distortion: Params, tolerance: float) -> Points:
        if not distortion.any():  # where solvers start: dozens of times, with focal lengths to choose from
            return np.column_stack([plane, np.ones(len(plane))])
        d = _padded(distortion)
        target = tilted(plane, np.asarray(np.linalg.inv(tilt_matrix(d[12], d[13])), dtype=np.float64))
        limit = self.valid_radius(distortion)
        guess = _radial_inverse(target, d, limit)
        found = _newton(target, guess, d, tolerance)
        found[np.hypot(found[:, 0], found[:, 1]) > limit] = np.nan
        return np.column_stack([found, np.ones(len(found))])

    def _on_plane(self, points: Points, distortion: Params) -> Floats:
        """(N, 2) x/z, y/z; NaN behind the camera and beyond the valid radius."""
        x, y, z = points.T
        plane = np.empty((2, len(points)))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            np.divide(x, z, out=plane[0])
            np.divide(y, z, out=plane[1])
            seen = (z > 0) & (np.hypot(plane[0], plane[1]) <= self.valid_radius(distortion))
        plane[:, ~seen] = np.nan
        return np.asarray(plane.T)


@lru_cache(maxsize=1024)  # roots take longer than projecting a view, and every projection asks
def _fold(numerator: tuple[float, ...], denominator: tuple[float, ...]) -> float:
    """The radius where r numerator(r²) / denominator(r²) stops growing, or has a pole; coefficients from r⁰ up."""
    top, bottom = np.polynomial.Polynomial(numerator), np.polynomial.Polynomial(denominator)
    twice_s = np.polynomial.Polynomial([0.0, 2.0])  # s = r²
    slope = (top + twice_s * top.deriv()) * bottom - twice_s * top * bottom.deriv()
    return float(np.sqrt(smallest_positive_root(slope.coef, bottom.coef)))


def _padded(distortion: Params) -> Params:
    return np.concatenate([distortion, np.zeros(len(NAMES) - len(distortion))])


def _radial(r2: Floats, d: Params) -> tuple[Floats, Floats, Floats]:
    """Numerator, denominator, and their quotient's derivative by r2."""
    k1, k2, _, _, k3, k4, k5, k6 = d[:8]
    numerator = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
    denominator = 1.0 + r2 * (k4 + r2 * (k5 + r2 * k6))
    by_r2 = k1 + r2 * (2 * k2 + 3 * r2 * k3) - numerator / denominator * (k4 + r2 * (2 * k5 + 3 * r2 * k6))
    return numerator, denominator, by_r2 / denominator


def _bent(plane: Floats, d: Params) -> Floats:
    """Radial, tangential and prism terms."""
    x, y = plane.T
    _, _, p1, p2, _, _, _, _, s1, s2, s3, s4 = d[:12]
    r2 = x * x + y * y
    numerator, denominator, _ = _radial(r2, d)
    radial, xy2 = numerator / denominator, 2.0 * x * y
    bent = np.array(
        [
            x * radial + p1 * xy2 + p2 * (r2 + 2 * x * x) + r2 * (s1 + s2 * r2),
            y * radial + p1 * (r2 + 2 * y * y) + p2 * xy2 + r2 * (s3 + s4 * r2),
        ]
    )
    return np.asarray(bent.T)


def _bent_jacobians(plane: Floats, d: Params, count: int) -> tuple[Floats, Floats]:
    """Derivatives of `_bent`: (N, 2, 2) by the plane's coordinates, (N, 2, count) by the first coefficients."""
    x, y = plane.T
    p1, p2 = d[2:4]
    s1, s2, s3, s4 = d[8:12]
    r2 = x * x + y * y
    numerator, denominator, radial_by_r2 = _radial(r2, d)
    radial = numerator / denominator
    by_plane = np.empty((2, 2, len(plane))).transpose(2, 0, 1)
    common_x = 2 * radial_by_r2 * x + 2 * (s1 + 2 * s2 * r2)
    common_y = 2 * radial_by_r2 * y + 2 * (s3 + 2 * s4 * r2)
    by_plane[:, 0, 0] = radial + common_x * x + 2 * p1 * y + 6 * p2 * x
    by_plane[:, 0, 1] = common_x * y + 2 * p1 * x + 2 * p2 * y
    by_plane[:, 1, 0] = common_y * x + 2 * p1 * x + 2 * p2 * y
    by_plane[:, 1, 1] = radial + common_y * y + 6 * p1 * y + 2 * p2 * x
    by_coefficients = np.zeros((2, count, len(plane))).transpose(2, 0, 1)
    powers = (r2, r2 * r2, r2 * r2 * r2)
    for index, factor in zip((0, 1, 4), powers, strict=True):
        if index < count:
            by_coefficients[:, :, index] = plane * (factor / denominator)[:, None]
    for index, factor in zip((5, 6, 7), powers, strict=True):
        if index < count:
            by_coefficients[:, :, index] = plane * (-radial * factor / denominator)[:, None]
    if count > 2:
        by_coefficients[:, 0, 2] = by_coefficients[:, 1, 3] = 2 * x * y
        by_coefficients[:, 0, 3] = r2 + 2 * x * x
        by_coefficients[:, 1, 2] = r2 + 2 * y * y
    if count > 8:
        by_coefficients[:, 0, 8] = by_coefficients[:, 1, 10] = r2
        by_coefficients[:, 0, 9] = by_coefficients[:, 1, 11] = r2 * r2
    return by_plane, by_coefficients


def _radial_inverse(target: Floats, d: Params, limit: float) -> Floats:
    """Where the points would be if there were radial terms only: the start of Newton's iteration."""

    def distort(r: Floats) -> Floats:
        numerator, denominator, _ = _radial(r * r, d)
        return r * numerator / denominator

    distorted = np.hypot(target[:, 0], target[:, 1])
    radius = inverse_radius(distorted, distort, limit)
    scale = np.divide(radius, distorted, out=np.ones_like(radius), where=distorted > 0)
    return np.asarray(target * scale[:, None], dtype=np.float64)


def _newton(target: Floats, guess: Floats, d: Params, tolerance: float) -> Floats:
    """Plane coordinates whose bent ones are the target; NaN where it does not converge."""
    found = guess
    with np.errstate(all="ignore"):
        for _ in range(50):
            error = _bent(found, d) - target
            if not (np.abs(error) > 0.1 * tolerance).any():
                break
            (a, b), (c, e) = np.moveaxis(_bent_jacobians(found, d, 0)[0], 0, -1)
            step = np.column_stack([e * error[:, 0] - b * error[:, 1], a * error[:, 1] - c * error[:, 0]])
            found = found - step / (a * e - b * c)[:, None]
        error = _bent(found, d) - target
        found[~(np.abs(error).max(axis=1) <= tolerance)] = np.nan
    return found
