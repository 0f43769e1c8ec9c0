"""The camera file: what OpenCSP reads, and beside it everything the calibration can be repeated from.

::

    /Camera                          what OpenCSP's Camera.load_from_hdf reads, to the last bit
        attributes: format_version, model, checksum (SHA-256 over the group)
        intrinsic_mat   (3, 3) f8    [fx 0 cx; 0 fy cy; 0 0 1], pixels
        distortion_coef (n,) f8      OpenCV order; a pinhole camera has four zeros; a fisheye camera has none, so that
                                     OpenCSP refuses it instead of taking its coefficients for others
        fisheye_coef    (4,) f8      of a fisheye camera: k1..k4
        image_shape_xy  (2,) i4      width, height
        name            string
    /Calibration                     ignored by OpenCSP; see `hdf5_calibration`

A file without ``format_version`` is OpenCSP's own; its oddities are read as OpenCSP reads them. Any file whose
checksum is missing or wrong though it has a ``format_version`` is refused. Behind the HDF5 content stands the checksum
of all of it, which is looked at first (`seal`).
"""

import hashlib
import json
import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Problem
from opencsp_calib.errors import FileFormatError, InputError
from opencsp_calib.hdf5_reading import opened, read_dataset
from opencsp_calib.hdf5_writing import write_hdf5
from opencsp_calib.models import OPENCV_MODELS

if TYPE_CHECKING:
    import h5py

__all__ = [
    "FORMAT_VERSION",
    "load_camera",
    "load_record",
    "read_camera",
    "save_camera",
    "write_camera",
]

FORMAT_VERSION = 1
MAX_COEFFICIENTS = 100  # of a dataset of /Camera; more is a damaged or hostile file


def save_camera(camera: Camera, path: str | os.PathLike[str], record: Mapping[str, str] | None = None) -> None:
    """Write a camera file without a calibration, maybe with notes about the camera.

    Raises
    ------
    InputError
        If its name does not end in .h5, .hdf5 or .hdf, or it cannot be written; what was there before stays.
    """

    def fill(file: "h5py.File") -> None:
        write_camera(camera, file)
        if record:
            file["Calibration/record"] = json.dumps(dict(record))

    write_hdf5(path, fill)


def load_record(path: str | os.PathLike[str]) -> dict[str, str]:
    """The notes kept with a camera: focus, aperture, how it was imported."""
    with opened(path) as file:
        if "Calibration/record" not in file:
            return {}
        record = json.loads(str(read_dataset(file["Calibration"], "record")))
        return {str(key): str(value) for key, value in record.items()}


def load_camera(path: str | os.PathLike[str]) -> Camera:
    """The camera of a camera file, ours or OpenCSP's.

    Raises
    ------
    FileFormatError
        If it is damaged, or no camera file.
    InputError
        If there is no such file.
    """
    return read_camera(path)[0]


def read_camera(path: str | os.PathLike[str]) -> tuple[Camera, tuple[Problem, ...]]:
    """Like `load_camera`, with what a person should know about the file."""
    with opened(path) as file:
        return _camera(file, str(path))


def write_camera(camera: Camera, file: "h5py.File") -> None:
    """Write the group /Camera into an open file."""
    group = file.create_group("Camera")
    group["intrinsic_mat"] = camera.matrix
    if camera.model == "opencv_fisheye":
        group["fisheye_coef"] = camera.distortion
    else:
        group["distortion_coef"] = camera.distortion if camera.distortion.size else np.zeros(4)
    group["image_shape_xy"] = np.array(camera.image_size, dtype=np.int32)
    group["name"] = camera.name.replace("\0", "\\0").encode("utf-8", "backslashreplace").decode()
    group.attrs["format_version"] = FORMAT_VERSION
    # of fixed length: the HDF5 library may hang or crash over a damaged attribute of variable length
    group.attrs["model"] = np.bytes_(camera.model)
    group.attrs["checksum"] = np.bytes_(_checksum(group))


def _camera(file: "h5py.File", path: str) -> tuple[Camera, tuple[Problem, ...]]:
    group = file.get("Camera")
    if group is None and "Calibration/observations" in file:
        raise FileFormatError(
            f"{path} holds what was seen in photographs, but no camera: `opencsp-calib solve {path} -o camera.h5` "
            "calibrates one from it"
        )
    if group is None:
        raise FileFormatError(f"{path} has no group /Camera: it is not a camera file")
    ours = "format_version" in group.attrs
    if ours:
        _verify(group, path)
    matrix = _numbers(group, "intrinsic_mat", (3, 3))
    size = _numbers(group, "image_shape_xy", (2,))
    model, distortion = _distortion(group, path)
    if abs(matrix[0, 1]) > 1e-9 * abs(matrix[0, 0]):
        raise FileFormatError(f"{path} has skew ({matrix[0, 1]:g}), which no lens model of ours has")
    params = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2], *distortion]
    try:
        camera = Camera(_name(group), model, np.array(params), (size[0], size[1]))
    except InputError as error:
        raise FileFormatError(f"{path}: {error}") from None
    return camera, _oddities(matrix, path)


def _verify(group: "h5py.Group", path: str) -> None:
    version = int(_attribute(group, "format_version"))
    if version > FORMAT_VERSION:
        raise FileFormatError(f"{path} was written by a newer opencsp-calib (format {version}); update this one")
    if _attribute(group, "checksum") != _checksum(group):
        raise FileFormatError(f"{path} is damaged: the checksum of /Camera does not fit its contents")


def _attribute(group: "h5py.Group", name: str) -> str:
    """A whole number or a text of fixed length, as text; empty if there is none."""
    if name not in group.attrs:
        return ""
    if group.attrs.get_id(name).dtype.kind not in "iuS":
        raise FileFormatError(f"{group.file.filename}: the attribute {name} of {group.name} is of an unexpected type")
    value = group.attrs[name]
    return value.decode() if isinstance(value, bytes) else str(value)


def _checksum(group: "h5py.Group") -> str:
    digest = hashlib.sha256(f"{_attribute(group, 'format_version')} {_attribute(group, 'model')}".encode())
    for name in sorted(group):
        value = read_dataset(group, name)
        if isinstance(value, str):
            content = value.encode()
        else:
            array = np.ascontiguousarray(value)
            content = f"{array.dtype.str} {array.shape}".encode() + array.tobytes()
        digest.update(f"\n{name} {len(content)}\n".encode() + content)
    return digest.hexdigest()


def _distortion(group: "h5py.Group", path: str) -> tuple[str, Floats]:
    model = _attribute(group, "model")
    if model == "opencv_fisheye":
        return model, _numbers(group, "fisheye_coef", (4,))
    coefficients = np.atleast_1d(_numbers(group, "distortion_coef", None))
    if model == "pinhole" and not coefficients.any():
        return model, np.empty(0)
    if not coefficients.size or coefficients.size not in OPENCV_MODELS:
        raise FileFormatError(f"{path} has {coefficients.size} distortion coefficients; OpenCV has 4, 5, 8, 12 or 14")
    by_size = OPENCV_MODELS[coefficients.size]
    if model and model != by_size:
        raise FileFormatError(f"{path} says its model is {model!r}, but has {coefficients.size} coefficients")
    return by_size, coefficients


def _numbers(group: "h5py.Group", name: str, shape: tuple[int, ...] | None) -> Floats:
    """A dataset of numbers, squeezed as OpenCSP does: sizes come as (2, 1), coefficients as (1, 5)."""
    values = np.asarray(read_dataset(group, name)).squeeze()
    if values.dtype.kind not in "fiu" or values.size > MAX_COEFFICIENTS or shape not in (None, values.shape):
        wanted = "" if shape is None else f" of shape {shape}"
        raise FileFormatError(f"{group.file.filename}: /Camera/{name} is not an array of numbers{wanted}")
    if not np.isfinite(values).all():
        raise FileFormatError(f"{group.file.filename}: /Camera/{name} has values that are not finite numbers")
    return values.astype(np.float64)


def _name(group: "h5py.Group") -> str:
    """The name, written as a string, a byte string or an array with one."""
    value: Any = read_dataset(group, "name")
    if isinstance(value, np.ndarray):
        if value.size != 1:
            raise FileFormatError(f"{group.file.filename}: /Camera/name is not one name")
        value = value.ravel()[0]
    return value.decode() if isinstance(value, bytes) else str(value)


def _oddities(matrix: Floats, path: str) -> tuple[Problem, ...]:
    corner = matrix[2, 2]
    if corner == 1.0:
        return ()
    message = (
        f"{path}: the camera matrix has {corner:g} where 1 belongs, as if it had been scaled as a whole; like OpenCV "
        "and OpenCSP, this program does not look at that number"
    )
    return (Problem("scaled-matrix", message),)
