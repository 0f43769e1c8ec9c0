"""Two cameras compared by what they do: by projection, after their frames are aligned.

The parameters of two calibrations cannot be compared number by number: where the optical axis points is known only
as well as the boards' poses, and a camera turned by a hair has another principal point and other tangential
coefficients while it sees the very same things. So a grid of pixels is unprojected with one camera, the frame change
that brings it to the other (a rotation; at a finite range also a translation) is fitted so that the pixel differences
are least, and what is left is the difference.

The idea is that of mrcal's "projection differences" (D. Kogan, mrcal documentation, differencing); here the frame
change is fitted to the pixel differences themselves, all over the image and all weighing the same.
"""

from dataclasses import dataclass, field
from math import isfinite

import numpy as np

from opencsp_calib.arrays import Floats, Mask, Matrix, Pixels, Points, Vector, frozen
from opencsp_calib.camera import Camera
from opencsp_calib.errors import InputError
from opencsp_calib.rotations import rotation_matrices, rotation_vectors

__all__ = ["GRID", "Difference", "compare", "frame_jacobian", "pixel_grid"]

GRID = (40, 30)
"""Columns and rows of pixels at which cameras are compared."""
MAX_STEPS = 200
MAX_DAMPING = 1e6
SMALL_GAIN = 1e-15  # of the cost: where a step promises less, the rest is rounding


@dataclass(frozen=True, eq=False)
class Difference:
    """How far apart two cameras see the same things, over the image, once their frames are aligned.

    Parameters
    ----------
    pixels : (r, c, 2) px
        The grid over the image, of the first camera.
    shift : (r, c, 2) px
        Where the second camera sees what the first sees at `pixels`, minus `pixels`; NaN where one has no image.
    rotation : (3, 3)
        Of the frame change: point in the second camera's frame = rotation @ point in the first's + translation.
    translation : (3,) m
        Zero at infinity, where it cannot be seen.
    range_m : float or None
        The distance from the camera at which they were compared; None at infinity.
    """

    pixels: Floats = field(repr=False)
    shift: Floats = field(repr=False)
    rotation: Matrix = field(repr=False)
    translation: Vector
    range_m: float | None

    def __post_init__(self) -> None:
        object.__setattr__(self, "pixels", frozen(self.pixels, "pixels", (None, None, 2)))
        object.__setattr__(self, "shift", frozen(self.shift, "shift", self.pixels.shape, finite=False))
        object.__setattr__(self, "rotation", frozen(self.rotation, "rotation", (3, 3)))
        object.__setattr__(self, "translation", frozen(self.translation, "translation", (3,)))

    @property
    def length_px(self) -> Floats:
        """(r, c) px length of the shift; NaN where one of the cameras has no image."""
        return np.asarray(np.linalg.norm(self.shift, axis=2), dtype=np.float64)

    @property
    def where(self) -> str:
        """For people: ``at infinity``, or at which range."""
        return "at infinity" if self.range_m is None else f"at {self.range_m:.4g} m"

    def __str__(self) -> str:
        return (
            f"{self.where}: rms {self.rms_px:.4g} px, median {self.median_px:.4g} px, worst {self.worst_px:.4g} px "
            f"over the image, after a turn of the frame by {self.rotation_deg:.4g} degrees"
        )

    @property
    def missing(self) -> int:
        """At how many pixels of the grid one of the cameras has no image: they are in no figure."""
        return int(np.isnan(self.length_px).sum())

    @property
    def rms_px(self) -> float:
        """Root mean square length of the shift over the image."""
        return float(np.sqrt(np.nanmean(self.length_px**2)))

    @property
    def median_px(self) -> float:
        """Median length of the shift over the image."""
        return float(np.nanmedian(self.length_px))

    @property
    def worst_px(self) -> float:
        """Largest length of the shift over the image."""
        return float(np.nanmax(self.length_px))

    @property
    def rotation_deg(self) -> float:
        """Angle of the rotation between the frames."""
        return float(np.degrees(np.linalg.norm(rotation_vectors(self.rotation))))


def compare(a: Camera, b: Camera, *, range_m: float | None = None, grid: tuple[int, int] = GRID) -> Difference:
    """How differently two cameras see the same things, after aligning their frames.

    Parameters
    ----------
    a, b : Camera
        Of the same image size; the lens models may differ.
    range_m : float, optional
        Compare what is seen at this distance from camera `a`, and let the frames differ by a translation too; by
        default at infinity, where only a rotation matters. A pixel does not tell how far away a thing is, so that all
        finite ranges give the same shift over the image, and a translation in proportion; since it makes up for most of
        a difference in focal length, cameras differ less at a finite range than at infinity.
    grid : (int, int)
        Columns and rows of the pixels compared, spread evenly from corner to corner.

    Returns
    -------
    Difference

    Raises
    ------
    InputError
        If the image sizes differ, the range is not positive, or hardly any pixel has a direction in both cameras.
    """
    if a.image_size != b.image_size:
        sizes = " and ".join(f"{w}x{h}" for w, h in (a.image_size, b.image_size))
        raise InputError(f"cameras with images of different sizes cannot be compared by pixels: {sizes}")
    if range_m is not None and not (isfinite(range_m) and range_m > 0):
        raise InputError(f"the range to compare at must be a positive number of metres, not {range_m}")
    pixels = pixel_grid(a.image_size, grid)
    flat = pixels.reshape(-1, 2)
    rays = a.unproject(flat)
    start = _rotation_between(rays, b.unproject(flat))
    rotation, offset = _fit_frame(b, rays, flat, start, shifted=range_m is not None)
    shift = b.project(rays @ rotation.T + offset) - flat
    translation = offset * (range_m or 0.0)
    return Difference(pixels, shift.reshape(pixels.shape), rotation, translation, range_m)


def pixel_grid(image_size: tuple[int, int], grid: tuple[int, int] = GRID) -> Floats:
    """(r, c, 2) px: pixels spread evenly over an image, the four corner pixels among them.

    Parameters
    ----------
    image_size : (int, int)
        Width and height.
    grid : (int, int)
        Columns and rows, at least 2 each.
    """
    if min(grid) < 2:
        raise InputError(f"a grid over the image needs at least 2 columns and 2 rows, not {grid[0]}x{grid[1]}")
    x, y = (np.linspace(0.0, side - 1.0, n) for side, n in zip(image_size, grid, strict=True))
    return np.stack(np.meshgrid(x, y), axis=2)


def frame_jacobian(by_point: Floats, points: Points, *, shifted: bool) -> Floats:
    """How pixels move when the frame of the points is turned, and shifted, by a little.

    Parameters
    ----------
    by_point : (N, 2, 3)
        Derivatives of the pixels with respect to the points.
    points : (N, 3)
    shifted : bool
        Whether the frame may be shifted too.

    Returns
    -------
    (N, 2, 3) or (N, 2, 6)
        By the rotation vector, rad, and by the shift, in the points' unit of length.
    """
    by_turn = np.cross(points[:, None, :], by_point)  # a turn w moves a point by w x point
    return np.concatenate([by_turn, by_point], axis=2) if shifted else by_turn


def _rotation_between(rays: Points, others: Points) -> Matrix:
    """The rotation (3, 3) that best turns the first unit vectors into the second."""
    known = np.isfinite(rays).all(axis=1) & np.isfinite(others).all(axis=1)
    if known.sum() < 4:
        raise InputError("the cameras cannot be compared: hardly any pixel has a direction in both of them")
    u, _, vt = np.linalg.svd(others[known].T @ rays[known])
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt, dtype=np.float64)


def _fit_frame(
    camera: Camera, points: Points, pixels: Pixels, start: Matrix, *, shifted: bool
) -> tuple[Matrix, Vector]:
    """The rotation and offset of points after which the camera sees them closest to pixels (Levenberg-Marquardt).

    A point that a step moves out of the camera's sight is left out from then on, and a step is judged by the points
    that both sides of it have: else dropping points would look like progress.
    """
    rotation, offset = start, np.zeros(3)
    moved = points @ rotation.T
    error = camera.project(moved) - pixels
    used = np.asarray(np.isfinite(error).all(axis=1))
    damping = 1e-6
    for _ in range(MAX_STEPS):
        step, promised = _frame_step(camera, moved[used], error[used], damping, shifted=shifted)
        if promised <= SMALL_GAIN * _cost(error, used) or damping > MAX_DAMPING:
            break
        turn = rotation_matrices(step[:3])
        new_rotation = turn @ rotation
        new_offset = turn @ offset + (step[3:] if shifted else 0.0)
        new_moved = points @ new_rotation.T + new_offset
        new_error = camera.project(new_moved) - pixels
        both = np.asarray(used & np.isfinite(new_error).all(axis=1))
        if _cost(new_error, both) < _cost(error, both):
            rotation, offset, moved, error, used = new_rotation, new_offset, new_moved, new_error, both
            damping = max(damping * 0.1, 1e-12)
        else:
            damping *= 10.0
    return rotation, offset


def _frame_step(
    camera: Camera, points: Points, error: Pixels, damping: float, *, shifted: bool
) -> tuple[Floats, float]:
    """(3,) or (6,) the damped step, and by how much the cost should fall.

    By QR, since over a narrow image a turn and a shift are almost the same.
    """
    _, by_point, _ = camera.lens.project_with_jacobians(points, camera.params)
    jacobian = frame_jacobian(by_point, points, shifted=shifted).reshape(error.size, -1)
    scale = np.linalg.norm(jacobian, axis=0)
    scaled = np.vstack([jacobian / scale, np.sqrt(damping) * np.eye(len(scale))])
    right = np.concatenate([-error.ravel(), np.zeros(len(scale))])
    step = np.linalg.lstsq(scaled, right, rcond=None)[0] / scale
    return step, float(-(jacobian.T @ error.ravel()) @ step)


def _cost(error: Pixels, used: Mask) -> float:
    return float((error[used] ** 2).sum())
