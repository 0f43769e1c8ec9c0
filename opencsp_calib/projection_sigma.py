"""How far to trust where a calibrated camera sees a thing: over the image and over range, in pixels and in radians.

A change of the camera's parameters that is nothing but another frame (turned; at a finite range also shifted) changes
no measurement whose frame is found from the images too. So, as in `compare`, the frame change that best undoes a
change of the parameters over the image is projected out: with J the derivatives of pixels by the parameters and F by
the frame, what is left is ``J - F (F⁺J)``, F⁺ being taken over a grid of pixels.

At a finite range, turn and shift together undo as much at one range as at any other (a pixel does not tell how far
away a thing is), so that the figure of one range, like that of `compare`, does not depend on it. Where the frame was
fixed by boards at the ranges they had, it does matter how far from there the camera is used: `sigma_over_range`.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from opencsp_calib.arrays import Floats, Matrix, Pixels, Points, checked
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.comparison import GRID, frame_jacobian, pixel_grid
from opencsp_calib.errors import InputError

__all__ = [
    "Alignment",
    "SigmaCurve",
    "SigmaMap",
    "board_ranges",
    "camera_sigma_map",
    "projection_covariance",
    "projection_sigma",
    "ray_sigma",
    "sigma_map",
    "sigma_over_range",
]

RANGE_STEPS = 5  # ranges between the nearest and the farthest corner of a board, at which the frame is fixed


@dataclass(frozen=True, eq=False)
class SigmaMap:
    """Standard deviations of projections over the image.

    Parameters
    ----------
    pixels : (r, c, 2) px
    sigma_px : (r, c) px
        Root mean square length of the error; NaN where the camera has no image.
    sigma_rad : (r, c) rad
        The same of the direction of the ray.
    range_m : float or None
        As in `compare`.
    """

    pixels: Floats = field(repr=False)
    sigma_px: Floats = field(repr=False)
    sigma_rad: Floats = field(repr=False)
    range_m: float | None

    @property
    def rms_px(self) -> float:
        """Over the image: what the `rms_px` of a `Difference` is to be held against."""
        return float(np.sqrt(np.nanmean(self.sigma_px**2)))

    @property
    def worst_px(self) -> float:
        """The largest over the image."""
        return float(np.nanmax(self.sigma_px))


@dataclass(frozen=True, eq=False)
class SigmaCurve:
    """Standard deviations of projections over range, rms over the image.

    Parameters
    ----------
    ranges_m : (R,) m
    sigma_px : (R,) px
    sigma_rad : (R,) rad
        Of the direction in which a thing at that range is seen.
    """

    ranges_m: Floats = field(repr=False)
    sigma_px: Floats
    sigma_rad: Floats


@dataclass(frozen=True, eq=False)
class Alignment:
    """The frame change that goes with a change of a camera's parameters.

    Parameters
    ----------
    camera : Camera
    frame_by_params : (3 or 6, P)
        The turn (rad), and the shift, that best undo a change of the parameters.
    grid_jacobian : (N, 2, P)
        Of the pixels of the grid it was fitted on, by the parameters, the frame change included.
    """

    camera: Camera
    frame_by_params: Matrix
    grid_jacobian: Floats

    @classmethod
    def at_infinity(cls, camera: Camera, grid: tuple[int, int] = GRID) -> "Alignment":
        """The frame may turn."""
        return cls._over(camera, _grid_rays(camera, grid), shifted=False)

    @classmethod
    def at_range(cls, camera: Camera, *ranges_m: float, grid: tuple[int, int] = GRID) -> "Alignment":
        """The frame may turn and shift, by what undoes most at these ranges together."""
        rays = _grid_rays(camera, grid)
        return cls._over(camera, np.concatenate([rays * r for r in ranges_m]), shifted=True)

    @classmethod
    def _over(cls, camera: Camera, points: Points, *, shifted: bool) -> "Alignment":
        _, by_point, by_params = camera.lens.project_with_jacobians(points, camera.params)
        by_frame = frame_jacobian(by_point, points, shifted=shifted)
        flat = by_frame.reshape(-1, by_frame.shape[2])
        scale = np.linalg.norm(flat, axis=0)
        solved = np.linalg.lstsq(flat / scale, by_params.reshape(len(flat), -1), rcond=None)[0]
        frame_by_params = -solved / scale[:, None]
        return cls(camera, frame_by_params, by_params + by_frame @ frame_by_params)

    def jacobian(self, points: Points) -> tuple[Floats, Floats]:
        """(N, 2, P) of the pixels of points by the parameters, frame change included; and (N, 2, 3) by the points."""
        _, by_point, by_params = self.camera.lens.project_with_jacobians(points, self.camera.params)
        by_frame = frame_jacobian(by_point, points, shifted=len(self.frame_by_params) == 6)
        return by_params + by_frame @ self.frame_by_params, by_point


def projection_covariance(
    calibration: Calibration, pixels: Pixels, range_m: float | None = None, *, covariance: Matrix | None = None
) -> Floats:
    """Covariance of where the camera sees what is seen at pixels, after the frame change that `compare` fits.

    Parameters
    ----------
    calibration : Calibration
    pixels : (N, 2)
    range_m : float, optional
        None for infinity, where the frame may only turn; at a finite range it may shift too.
    covariance : (P, P), optional
        Of the parameters; by default the calibration's honest one.

    Returns
    -------
    (N, 2, 2) px²
        NaN where the camera has no image, or the covariance is not known.
    """
    jacobian, _ = _at(calibration.camera, checked(pixels, "pixels", (None, 2), finite=False), range_m)
    return _propagated(jacobian, calibration.covariance if covariance is None else covariance)


def projection_sigma(
    calibration: Calibration, pixels: Pixels, range_m: float | None = None, *, covariance: Matrix | None = None
) -> Floats:
    """(N,) px root mean square length of the error of projections; see `projection_covariance`."""
    return _length(projection_covariance(calibration, pixels, range_m, covariance=covariance))


def ray_sigma(
    calibration: Calibration, pixels: Pixels, range_m: float | None = None, *, covariance: Matrix | None = None
) -> Floats:
    """(N,) rad root mean square error of the directions that pixels show; see `projection_covariance`."""
    jacobian, by_angle = _at(calibration.camera, checked(pixels, "pixels", (None, 2), finite=False), range_m)
    jacobian = np.asarray(np.linalg.solve(by_angle, jacobian))
    return _length(_propagated(jacobian, calibration.covariance if covariance is None else covariance))


def sigma_map(
    calibration: Calibration,
    range_m: float | None = None,
    *,
    grid: tuple[int, int] = GRID,
    covariance: Matrix | None = None,
) -> SigmaMap:
    """Standard deviations over the image, on the grid of columns and rows that `compare` takes.

    See `projection_covariance`.
    """
    covariance = calibration.covariance if covariance is None else covariance
    return camera_sigma_map(calibration.camera, covariance, range_m, grid=grid)


def camera_sigma_map(
    camera: Camera, covariance: Matrix, range_m: float | None = None, *, grid: tuple[int, int] = GRID
) -> SigmaMap:
    """The same for a camera of which nothing but the parameters and their covariance (P, P) is known."""
    pixels = pixel_grid(camera.image_size, grid)
    jacobian, by_angle = _at(camera, pixels.reshape(-1, 2), range_m, grid)
    sigma_px = _length(_propagated(jacobian, covariance))
    sigma_rad = _length(_propagated(np.asarray(np.linalg.solve(by_angle, jacobian)), covariance))
    return SigmaMap(pixels, sigma_px.reshape(pixels.shape[:2]), sigma_rad.reshape(pixels.shape[:2]), range_m)


def sigma_over_range(
    calibration: Calibration, ranges_m: Sequence[float], *, covariance: Matrix | None = None
) -> SigmaCurve:
    """Standard deviation of projections at each range, rms over the image, the frame being fixed by the boards.

    Turn and shift of the frame are fitted once, to the grid of pixels at the ranges that the boards' corners had. It
    is least there, and grows towards what is nearer and farther: ranges that no view has shown.

    Parameters
    ----------
    calibration : Calibration
    ranges_m : sequence of float
        Distances from the camera; infinity is one.
    covariance : (P, P), optional
        As in `projection_covariance`.
    """
    camera, ranges = calibration.camera, np.asarray(ranges_m, dtype=np.float64)
    if not (ranges > 0).all():
        raise InputError("ranges must be positive")
    near, far = board_ranges(calibration)
    alignment = Alignment.at_range(camera, *np.linspace(near, far, RANGE_STEPS))
    rays = _grid_rays(camera)
    covariance = calibration.covariance if covariance is None else covariance
    sigmas = []
    for distance in np.minimum(ranges, 1e6 * far):  # as good as infinity
        jacobian, by_point = alignment.jacobian(rays * distance)
        across = np.asarray(np.linalg.solve(_by_angle(by_point, rays, distance), jacobian))
        sigmas.append([np.sqrt((_length(_propagated(j, covariance)) ** 2).mean()) for j in (jacobian, across)])
    sigma_px, sigma_rad = np.array(sigmas).T
    return SigmaCurve(ranges, sigma_px, sigma_rad)


def board_ranges(calibration: Calibration) -> tuple[float, float]:
    """Distances from the camera of the nearest and the farthest corner seen, metres."""
    distances = [
        np.linalg.norm(pose.transform(calibration.board.points[detection.ids]), axis=1)
        for pose, detection in zip(calibration.cam_from_board, calibration.observations.detections, strict=True)
    ]
    return float(min(d.min() for d in distances)), float(max(d.max() for d in distances))


def _at(camera: Camera, pixels: Pixels, range_m: float | None, grid: tuple[int, int] = GRID) -> tuple[Floats, Floats]:
    """(N, 2, P) of pixels by the parameters, frame change included; (N, 2, 2) by the ray's direction, px/rad."""
    if range_m is None:
        alignment = Alignment.at_infinity(camera, grid)
    else:
        alignment = Alignment.at_range(camera, range_m, grid=grid)
    rays = camera.unproject(pixels)
    jacobian, by_point = alignment.jacobian(rays * (range_m or 1.0))
    return jacobian, _by_angle(by_point, rays, range_m or 1.0)


def _by_angle(by_point: Floats, rays: Points, range_m: float) -> Floats:
    """(N, 2, 2) px/rad: how pixels move when what is seen along unit rays (N, 3) turns about the camera."""
    across = np.where(np.abs(rays[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = np.cross(rays, across)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    tangents = np.stack([first, np.cross(rays, first)], axis=2)
    return np.asarray(by_point @ tangents * range_m)


def _grid_rays(camera: Camera, grid: tuple[int, int] = GRID) -> Points:
    rays = camera.unproject(pixel_grid(camera.image_size, grid).reshape(-1, 2))
    return rays[np.isfinite(rays).all(axis=1)]


def _propagated(jacobian: Floats, covariance: Matrix) -> Floats:
    return np.asarray(jacobian @ covariance @ jacobian.transpose(0, 2, 1))


def _length(covariance: Floats) -> Floats:
    return np.asarray(np.sqrt(np.trace(covariance, axis1=1, axis2=2)))
