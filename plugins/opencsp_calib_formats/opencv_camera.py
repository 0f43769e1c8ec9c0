"""A camera matrix and distortion coefficients in OpenCV's conventions: what most programs write, under many names."""

from collections.abc import Callable
from pathlib import Path

import numpy as np

from opencsp_calib import Camera, InputError, Problem
from opencsp_calib.arrays import Floats, Params, Pixels, Points
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib.models import OPENCV_MODELS, lens_model

__all__ = ["carried", "either_model", "opencv_camera"]


def opencv_camera(
    name: str,
    matrix: Floats,
    coefficients: Params,
    image_size: tuple[int, int] | None,
    *,
    fisheye: bool = False,
    notes: tuple[Problem, ...] = (),
) -> Imported:
    """The import of a camera matrix and coefficients in OpenCV's order.

    Parameters
    ----------
    name : str
    matrix : (3, 3) px
        [fx s cx; 0 fy cy; 0 0 1], the centre of the upper-left pixel being (0, 0). A skew s is an obstacle.
    coefficients : (n,)
        0, 4, 5, 8, 12 or 14 of them; for fisheye 4, or none for all zero.
    image_size : (int, int) or None
    fisheye : bool
        Whether they are those of OpenCV's fisheye model.
    notes : tuple of Problem

    Raises
    ------
    FileFormatError
        If the matrix is no camera matrix, or the number of coefficients is none of OpenCV's.
    """
    fx, skew, cx, fy, cy = matrix[0, 0], matrix[0, 1], matrix[0, 2], matrix[1, 1], matrix[1, 2]
    if matrix[1, 0] != 0 or (matrix[2] != (0.0, 0.0, 1.0)).any():
        raise FileFormatError(f"camera {name!r}: {matrix.tolist()} is no camera matrix [fx 0 cx; 0 fy cy; 0 0 1]")
    if fisheye and len(coefficients) == 0:
        coefficients = np.zeros(4)
    if (fisheye and len(coefficients) != 4) or len(coefficients) not in OPENCV_MODELS:
        counts = "4" if fisheye else "0, 4, 5, 8, 12 or 14"
        raise FileFormatError(f"camera {name!r} has {len(coefficients)} distortion coefficients, expected {counts}")
    model = "opencv_fisheye" if fisheye else OPENCV_MODELS[len(coefficients)]
    params = np.array([fx, fy, cx, cy, *coefficients])
    imported = as_imported(name, model, params, image_size, notes)
    if skew == 0:
        return imported
    obstacle = f"skew = {skew:g} px (our models have none)"
    return not_exactly((obstacle,), _through_matrix(model, coefficients, matrix), image_size, notes)


def either_model(
    key: str, name: str, matrix: Floats, coefficients: Params, image_size: tuple[int, int] | None, why: str
) -> dict[str, Imported]:
    """Both readings of four coefficients that may be k1 k2 p1 p2 or fisheye's k1 k2 k3 k4, by the name of the model.

    Whoever imports has to choose one, as of any two cameras.
    """
    note = Problem("ambiguous-model", f"{why}: 4 coefficients are k1 k2 p1 p2 of opencv4 or k1..k4 of opencv_fisheye")
    readings = {"opencv4": False, "opencv_fisheye": True}
    prefix = f"{key}:" if key else ""
    return {
        f"{prefix}{model}": opencv_camera(name, matrix, coefficients, image_size, fisheye=fisheye, notes=(note,))
        for model, fisheye in readings.items()
    }


def _through_matrix(model: str, coefficients: Params, matrix: Floats) -> Callable[[Points], Pixels]:
    """A projection with a general camera matrix behind a model's distortion: u = fx x' + s y' + cx."""
    lens = lens_model(model)
    normalised = np.concatenate([[1.0, 1.0, 0.0, 0.0], coefficients])

    def project(points: Points) -> Pixels:
        return np.asarray(lens.project(points, normalised) @ matrix[:2, :2].T + matrix[:2, 2], dtype=np.float64)

    return project


def carried(camera: Camera, models: tuple[str, ...], path: Path, title: str) -> tuple[str, Params]:
    """The model to write a camera as, and its coefficients: exactly the same projection, with zeros added or left out.

    Parameters
    ----------
    camera : Camera
    models : tuple of str
        What the format carries.
    path, title
        For the message.

    Raises
    ------
    InputError
        If none of the models is exact; the message names the coefficients in the way.
    """
    if camera.model in models:
        return camera.model, camera.distortion
    counts = {model: count for count, model in OPENCV_MODELS.items()}
    needed = int(np.flatnonzero(camera.distortion).max(initial=-1)) + 1
    if camera.model in counts:
        for model in sorted((m for m in models if m in counts), key=counts.__getitem__):
            if counts[model] >= needed:
                padded = np.concatenate([camera.distortion, np.zeros(14)])
                return model, padded[: counts[model]]
    names = camera.lens.distortion_names[:needed]
    way = f", {names[-1]} = {camera.distortion[needed - 1]:g} is in the way" if camera.model in counts and names else ""
    raise InputError(f"cannot write {path}: {title} carries {', '.join(models)}, not {camera.model}{way}; see --fit")
