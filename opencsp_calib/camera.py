"""The camera: a lens model with numbers in it, and the size of its images."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from opencsp_calib.arrays import Floats, Matrix, Params, Pixels, Points, checked, frozen
from opencsp_calib.errors import InputError
from opencsp_calib.models import LensModel, lens_model

__all__ = ["Camera"]

MAX_SIDE = 1_000_000  # pixels; larger is a damaged file, not an image


@dataclass(frozen=True, eq=False)
class Camera:
    """How a camera images directions: its intrinsics. Where it stands is a `Pose`.

    Parameters
    ----------
    name : str
        What people call this camera with this lens.
    model : str
        The lens model's name: ``pinhole``, ``opencv4``, ``opencv5``, ``opencv8``, ``opencv12``, ``opencv14`` or
        ``opencv_fisheye``.
    params : (P,)
        fx, fy, cx, cy in pixels, then the distortion coefficients in OpenCV's order. The centre of the upper-left
        pixel is (0, 0).
    image_size : (int, int)
        Width and height in pixels.

    Raises
    ------
    InputError
        If the number of parameters is not the model's, one is not finite, a focal length is not positive, or the
        image size is not two positive whole numbers.
    """

    name: str
    model: str
    params: Params
    image_size: tuple[int, int]

    def __post_init__(self) -> None:
        expected = len(self.lens.parameter_names)
        object.__setattr__(self, "params", frozen(self.params, "params", (expected,)))
        object.__setattr__(self, "image_size", _checked_size(self.image_size))
        if not (self.params[:2] > 0).all():
            raise InputError(
                f"the focal lengths must be positive, but fx = {self.params[0]:g}, fy = {self.params[1]:g}"
            )

    @property
    def lens(self) -> LensModel:
        """The lens model."""
        return lens_model(self.model)

    @property
    def matrix(self) -> Matrix:
        """(3, 3) camera matrix [fx 0 cx; 0 fy cy; 0 0 1], pixels."""
        fx, fy, cx, cy = self.params[:4]
        return np.array([[fx, 0.0, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])

    @property
    def distortion(self) -> Params:
        """(P - 4,) distortion coefficients in OpenCV's order."""
        return self.params[4:]

    @property
    def valid_radius(self) -> float:
        """Where the distortion folds back: tan(theta), for fisheye theta in radians; infinite if nowhere."""
        return self.lens.valid_radius(self.distortion)

    @property
    def field_of_view(self) -> tuple[float, float, float]:
        """Horizontal, vertical and diagonal field of view in radians, from pixel edge to pixel edge; NaN if folded."""
        width, height = self.image_size
        left, right, top, bottom = -0.5, width - 0.5, -0.5, height - 0.5
        middle = self.params[2:4]
        ends = [
            [left, middle[1]],
            [right, middle[1]],
            [middle[0], top],
            [middle[0], bottom],
            [left, top],
            [right, bottom],
        ]
        rays = self.unproject(np.array(ends))
        one, other = rays[::2], rays[1::2]
        angles = np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), (one * other).sum(axis=1))
        behind = (one + other)[:, 2] < 0.0  # then the shorter way between them is not through the image
        horizontal, vertical, diagonal = np.where(behind, 2.0 * np.pi - angles, angles).tolist()
        return horizontal, vertical, diagonal

    def project(self, points: ArrayLike) -> Pixels:
        """Pixels of points in the camera's frame (x right, y down, z forward).

        Parameters
        ----------
        points : (N, 3)
            Any unit of length; directions will do.

        Returns
        -------
        (N, 2) px
            NaN where a point has no image: behind the camera, or beyond the valid radius.
        """
        return self.lens.project(checked(points, "points", (None, 3), finite=False), self.params)

    def unproject(self, pixels: ArrayLike) -> Points:
        """Unit vectors towards what pixels show, converged to 1e-9 px.

        Parameters
        ----------
        pixels : (N, 2)

        Returns
        -------
        (N, 3)
            NaN where no direction within the valid radius ends in the pixel.
        """
        return self.lens.unproject(checked(pixels, "pixels", (None, 2), finite=False), self.params)

    def binned(self, n: int) -> "Camera":
        """The same with n x n pixels averaged (or summed) into one: ``c' = (c + 1/2)/n - 1/2``, ``f' = f/n``."""
        return self._reduced(n, lambda c: (c + 0.5) / n - 0.5, lambda side: side // n)

    def subsampled(self, n: int) -> "Camera":
        """The same with every n-th pixel taken, from pixel 0 on: ``c' = c/n``, ``f' = f/n``."""
        return self._reduced(n, lambda c: c / n, lambda side: -(-side // n))

    def cropped(self, x: int, y: int, width: int, height: int) -> "Camera":
        """The same with only a region of its pixels, from (x, y) on, of the given size.

        Raises
        ------
        InputError
            If the region is not within the image.
        """
        if min(x, y) < 0 or min(width, height) < 1 or x + width > self.image_size[0] or y + height > self.image_size[1]:
            size = "x".join(map(str, self.image_size))
            raise InputError(f"the region {width}x{height} at ({x}, {y}) is not within the {size} image")
        offset = np.zeros_like(self.params)
        offset[2:4] = x, y
        return replace(self, params=self.params - offset, image_size=(width, height))

    def undistort(self, image: NDArray[Any], target: "Camera | None" = None) -> NDArray[Any]:
        """An image as a pinhole camera would have taken it; see `opencsp_calib.undistortion`."""
        from opencsp_calib.undistortion import undistort

        return undistort(image, self, target)

    def save(self, path: str | PathLike[str]) -> None:
        """Write a camera file (.h5) that OpenCSP reads too; see `opencsp_calib.hdf5`.

        Other formats are written by `opencsp_calib.camera_files.write_camera_file`.
        """
        from opencsp_calib.hdf5 import save_camera

        save_camera(self, path)

    @classmethod
    def load(cls, path: str | PathLike[str]) -> "Camera":
        """Read a camera file, ours or OpenCSP's; see `opencsp_calib.hdf5`."""
        from opencsp_calib.hdf5 import load_camera

        return load_camera(path)

    def to_opencsp(self) -> Any:
        """OpenCSP's own Camera, where OpenCSP is installed; see `opencsp_calib.opencsp`."""
        from opencsp_calib.opencsp import to_opencsp

        return to_opencsp(self)

    @classmethod
    def from_opencsp(cls, camera: Any) -> "Camera":
        """From OpenCSP's own Camera; see `opencsp_calib.opencsp`."""
        from opencsp_calib.opencsp import from_opencsp

        return from_opencsp(camera)

    def _reduced(self, n: int, centre: Callable[[Floats], Floats], side: Callable[[int], int]) -> "Camera":
        if not isinstance(n, int | np.integer) or n < 1:
            raise InputError(f"images can be reduced by a whole number from 1 on, not by {n!r}")
        params = self.params.copy()
        params[:2] /= n
        params[2:4] = centre(params[2:4])
        return replace(self, params=params, image_size=(side(self.image_size[0]), side(self.image_size[1])))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Camera):
            return NotImplemented
        same = (self.name, self.model, self.image_size) == (other.name, other.model, other.image_size)
        return same and np.array_equal(self.params, other.params)

    __hash__ = None  # type: ignore[assignment]  # holds an array

    def __repr__(self) -> str:
        values = ", ".join(f"{n}={v:.6g}" for n, v in zip(self.lens.parameter_names, self.params, strict=True))
        return f"Camera({self.name!r}, {self.model}, {self.image_size[0]}x{self.image_size[1]}, {values})"


def _checked_size(size: tuple[int, int]) -> tuple[int, int]:
    try:
        width, height = (int(side) for side in size)
        whole = (width, height) == tuple(size)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"image_size must be width and height, not {size!r}") from None
    if not whole or not (1 <= width <= MAX_SIDE and 1 <= height <= MAX_SIDE):
        raise InputError(f"image_size must be two positive whole numbers of pixels, not {width} x {height}")
    return width, height
