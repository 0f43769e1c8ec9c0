"""Imports that `as_imported` does not do: no lens model of ours, no image size in the file, many cameras in it."""

from collections import Counter
from collections.abc import Callable, Iterable
from typing import TypeAlias, TypeVar

import numpy as np

from opencsp_calib import Camera, Problem
from opencsp_calib.arrays import Floats, Points
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.lens import to_pixels

__all__ = ["Intrinsics", "Size", "each_camera", "needing_size", "other_camera"]

T = TypeVar("T")
Size: TypeAlias = tuple[int, int]
"""Width and height, pixels."""
Intrinsics: TypeAlias = tuple[float, float, float, float]
"""fx, fy, cx, cy, pixels; the centre of the upper-left pixel is (0, 0)."""
MAX_CAMERAS = 20_000


def other_camera(
    name: str,
    obstacles: tuple[str, ...],
    plane: Callable[[Points], Floats],
    intrinsics: Intrinsics,
    image_size: Size | None,
    notes: tuple[Problem, ...] = (),
    *,
    skew: float = 0.0,
) -> Imported:
    """The import of a camera that is none of ours, checked like one.

    Parameters
    ----------
    name : str
    obstacles : tuple of str
        What is in the way.
    plane : callable
        (N, 3) points to (N, 2) distorted coordinates, before focal length and principal point.
    intrinsics : fx, fy, cx, cy
        Pixels; the centre of the upper-left pixel is (0, 0).
    image_size : (int, int) or None
    notes : tuple of Problem
    skew : float
        Pixels.

    Raises
    ------
    InputError
        If a focal length is not positive, or the image size is none.
    """
    camera = Camera(name, "pinhole", np.array(intrinsics), image_size or (1, 1))
    fx, fy, cx, cy = (float(value) for value in camera.params)
    return not_exactly(
        obstacles,
        lambda points: to_pixels(plane(points), fx, fy, cx, cy, skew),
        None if image_size is None else camera.image_size,
        notes,
    )


def needing_size(image_size: Size | None, make: Callable[[Size], Imported], nominal: Size = (1000, 1000)) -> Imported:
    """An import whose parameters in pixels depend on the image size.

    Parameters
    ----------
    image_size : (int, int) or None
        None where the file does not have it: whoever imports is asked for it.
    make : callable
        The import for an image size.
    nominal : (int, int)
        A size to try it with, so that what is wrong with the file is said at once.
    """
    if image_size is not None:
        return make(image_size)
    tried = make(nominal)
    return Imported(None, None, None, tried.obstacles, tried.notes, make)


def each_camera(found: Iterable[tuple[str, T]], make: Callable[[str, T], Imported]) -> dict[str, Imported]:
    """The imports of all cameras of a file, by name.

    Parameters
    ----------
    found : iterable of (name, whatever the file says of it)
        A name that was there before gets a number behind it.
    make : callable
        The import for a name and what the file says.

    Raises
    ------
    FileFormatError
        If there is none, or more than a file can reasonably hold.
    """
    cameras: dict[str, Imported] = {}
    times: Counter[str] = Counter()
    for name, said in found:
        unique = name
        while unique in cameras:
            times[name] += 1
            unique = f"{name} ({times[name] + 1})"
        cameras[unique] = make(unique, said)
        if len(cameras) > MAX_CAMERAS:
            raise FileFormatError(f"more than {MAX_CAMERAS} cameras")
    if not cameras:
        raise FileFormatError("no camera in it")
    return cameras
