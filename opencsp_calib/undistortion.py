"""Images without their lens distortion: as a pinhole camera would have taken them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.camera import Camera
from opencsp_calib.errors import InputError
from opencsp_calib.images import ImageFile, read_image, write_image
from opencsp_calib.opencv import opencv

__all__ = ["undistort", "undistort_images"]

NOWHERE_PX = -1e6  # far outside of the image, so that it becomes 0


def undistort(image: NDArray[Any], camera: Camera, target: Camera | None = None) -> NDArray[Any]:
    """An image as a camera without distortion would have taken it.

    Parameters
    ----------
    image : (height, width) or (height, width, channels)
        Of the camera's image size.
    camera : Camera
        That took it.
    target : Camera, optional
        That should have taken it; by default a pinhole with the same focal lengths, principal point and size.

    Returns
    -------
    array of the same type
        Interpolated linearly; 0 where nothing was photographed.

    Raises
    ------
    InputError
        If the image has another size than the camera's.
    """
    _check_size(image, camera)
    return _taken(image, _places(camera, target or _pinhole(camera)))


def undistort_images(
    camera: Camera, files: tuple[ImageFile, ...], folder: Path, progress: Callable[[int, int], None] | None = None
) -> None:
    """Write images without their lens distortion into another folder, as PNG.

    Parameters
    ----------
    camera : Camera
    files : tuple of ImageFile
    folder : Path
        Made if it does not exist.
    progress : callable, optional
        Told how many are done, and how many there are, after each.

    Raises
    ------
    InputError
        If the folder is a file, or holds the images themselves; two images would get one name; or one cannot be read,
        or has another size.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file; give a folder")
    if folder.absolute() in {file.path.absolute().parent for file in files}:
        raise InputError(f"{folder} holds the photographs themselves; give another folder")
    targets = _targets(files, folder)
    places = _places(camera, _pinhole(camera))
    for done, (target, file) in enumerate(targets.items(), start=1):
        pixels = read_image(file).pixels
        try:
            _check_size(pixels, camera)
        except InputError as error:
            raise InputError(f"{file.path}: {error}") from None
        target.parent.mkdir(parents=True, exist_ok=True)
        write_image(_taken(pixels, places), target)
        if progress:
            progress(done, len(files))


def _targets(files: tuple[ImageFile, ...], folder: Path) -> dict[Path, ImageFile]:
    targets: dict[Path, ImageFile] = {}
    for file in files:
        target = folder / Path(file.name).with_suffix(".png")
        if target in targets:
            raise InputError(f"{targets[target].path} and {file.path} would both become {target}; do one at a time")
        targets[target] = file
    return targets


def _pinhole(camera: Camera) -> Camera:
    return Camera(camera.name, "pinhole", camera.params[:4], camera.image_size)


def _check_size(image: NDArray[Any], camera: Camera) -> None:
    height, width = image.shape[:2]
    if (width, height) != camera.image_size:
        size = "x".join(map(str, camera.image_size))
        raise InputError(f"the image is {width}x{height}, but the camera {camera.name!r} is for {size}")


def _places(camera: Camera, target: Camera) -> NDArray[np.float32]:
    """(height, width, 2) px where in the camera's image each pixel of the target's is; row by row, to save memory."""
    width, height = target.image_size
    places = np.empty((height, width, 2), dtype=np.float32)
    for y in range(height):
        row = np.column_stack([np.arange(width), np.full(width, y)])
        places[y] = camera.project(target.unproject(row))
    places[np.isnan(places)] = NOWHERE_PX
    return places


def _taken(image: NDArray[Any], places: NDArray[np.float32]) -> NDArray[Any]:
    cv2 = opencv()
    return np.asarray(cv2.remap(image, places[..., 0], places[..., 1], cv2.INTER_LINEAR))
