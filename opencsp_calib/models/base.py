"""What a lens model is."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np

from opencsp_calib.arrays import Floats, Params, Pixels, Points

__all__ = ["CONVERGED_PX", "LensModel", "inverse_radius", "smallest_positive_root"]

CONVERGED_PX = 1e-9
"""`unproject` iterates until its rays project back to the pixels this closely."""


class LensModel(ABC):
    """A named projection of points in the camera's frame (x right, y down, z forward) to pixels.

    The parameters are fx, fy, cx, cy in pixels, then the distortion coefficients in OpenCV's order; the centre of the
    upper-left pixel is (0, 0). A subclass gives the formula on the plane at unit distance (or sphere); everything
    that has no image is NaN.
    """

    name: str
    distortion_names: tuple[str, ...]

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """The names of all parameters, in order: fx, fy, cx, cy, then the distortion."""
        return ("fx", "fy", "cx", "cy", *self.distortion_names)

    def project(self, points: Points, params: Params) -> Pixels:
        """Pixels of points.

        Parameters
        ----------
        points : (N, 3) in the camera's frame, any unit of length
        params : (P,)

        Returns
        -------
        (N, 2) px
            NaN where a point has no image: behind the camera, or beyond the valid radius.
        """
        return self._distorted(points, params[4:]) * params[:2] + params[2:4]

    def project_with_jacobians(self, points: Points, params: Params) -> tuple[Pixels, Floats, Floats]:
        """Pixels of points, and how they change.

        Parameters
        ----------
        points : (N, 3) in the camera's frame
        params : (P,)

        Returns
        -------
        pixels : (N, 2) px
        by_point : (N, 2, 3)
            Derivative with respect to the point.
        by_params : (N, 2, P)
            Derivative with respect to the parameters.

        Notes
        -----
        In memory the points come last: one number of all points side by side is what NumPy is quick at.
        """
        plane, by_point, by_distortion = self._distorted_with_jacobians(points, params[4:])
        pixels = plane * params[:2] + params[2:4]
        by_params = np.zeros((2, len(params), len(points))).transpose(2, 0, 1)
        by_params[:, 0, 0], by_params[:, 1, 1] = plane[:, 0], plane[:, 1]
        by_params[:, 0, 2] = by_params[:, 1, 3] = 1.0
        np.multiply(by_distortion, params[:2, None], out=by_params[:, :, 4:])
        by_point *= params[:2, None]
        return pixels, by_point, by_params

    def unproject(self, pixels: Pixels, params: Params) -> Points:
        """Unit vectors of the rays that end in pixels, converged to `CONVERGED_PX`.

        Parameters
        ----------
        pixels : (N, 2)
        params : (P,)

        Returns
        -------
        (N, 3)
            NaN where no ray within the valid radius ends in the pixel.
        """
        rays = self._undistorted(
            (pixels - params[2:4]) / params[:2], params[4:], CONVERGED_PX / np.abs(params[:2]).max()
        )
        return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True), dtype=np.float64)

    @abstractmethod
    def valid_radius(self, distortion: Params) -> float:
        """Where the distortion polynomial folds back (or has a pole): the model means nothing from there on.

        Parameters
        ----------
        distortion : (P - 4,)

        Returns
        -------
        float
            As tan(theta) for models on the plane, as theta in radians for fisheye, theta being the angle to the
            optical axis; infinite where it never folds.
        """

    @abstractmethod
    def max_angle(self, distortion: Params) -> float:
        """The valid radius as an angle to the optical axis, radians."""

    @abstractmethod
    def _distorted(self, points: Points, distortion: Params) -> Floats:
        """(N, 2) distorted coordinates, before focal length and principal point."""

    @abstractmethod
    def _distorted_with_jacobians(self, points: Points, distortion: Params) -> tuple[Floats, Floats, Floats]:
        """The same, with its derivatives: (N, 2), (N, 2, 3) by point, (N, 2, P - 4) by distortion."""

    @abstractmethod
    def _undistorted(self, plane: Floats, distortion: Params, tolerance: float) -> Points:
        """(N, 3) rays, of any length, of distorted coordinates (N, 2)."""


def smallest_positive_root(*polynomials: Any) -> float:
    """The smallest positive real root of polynomials (arrays, from the constant term up); infinite if none.

    Found as the inverse of the largest root of the polynomials turned around: a term of 1e-50 at their end is a root
    next to 0 there; at their beginning it would be one so far out that it takes the digits of the others.
    """
    inverse = np.concatenate([np.roots(polynomial) for polynomial in polynomials])  # takes the highest term first
    real = inverse[np.abs(inverse.imag) <= 1e-9 * np.abs(inverse)].real
    largest = float(real.max(initial=0.0))
    return 1.0 / largest if largest > 0 else np.inf


def inverse_radius(distorted: Floats, distort: Callable[[Floats], Floats], limit: float) -> Floats:
    """Radii whose distorted radius is the given one, by bisection, good enough to start Newton from.

    Parameters
    ----------
    distorted : (N,)
    distort : callable
        Monotonic on [0, limit].
    limit : float
        The valid radius, maybe infinite.

    Returns
    -------
    (N,)
        The limit itself where the distorted radius is never reached.
    """
    low = np.zeros_like(distorted)
    high = np.minimum(np.maximum(distorted, 1e-3), limit)  # the limit itself may be so far out that halving never ends
    for _ in range(60):
        short = (high < limit) & (distort(high) < distorted)
        if not short.any():
            break
        high[short] = np.minimum(2.0 * high[short], limit)
    for _ in range(30):
        middle = 0.5 * (low + high)
        below = distort(middle) < distorted
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)
