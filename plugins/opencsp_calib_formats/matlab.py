"""MATLAB's cameraParameters, cameraIntrinsics and their fisheye kin: structures or saved objects in .mat, or JSON.

The centre of the upper-left pixel is (1, 1), so one pixel is taken from the principal point. RadialDistortion (2 or 3)
and TangentialDistortion (2) are OpenCV's k1 k2 [k3] and p1 p2; DistortionCoefficients are those of its fisheye model.
MappingCoefficients are Scaramuzza's (see `scaramuzza`).

Traps: ``IntrinsicMatrix`` is the camera matrix transposed, ``K`` (R2022b on) is not: the row or column (0, 0, 1) tells.
ImageSize is rows, columns, and missing before R2015. What people keep in cameraParams.mat is a saved object.

Source: MathWorks documentation, "cameraIntrinsics", "cameraIntrinsicsToOpenCV", "fisheyeIntrinsics".
"""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib import Camera
from opencsp_calib.arrays import Floats
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields, whole
from opencsp_calib_formats.mat_file import OBJECTS, is_mat, read_mat
from opencsp_calib_formats.mat_v5 import Opaque
from opencsp_calib_formats.opencv_camera import opencv_camera
from opencsp_calib_formats.other_camera import each_camera
from opencsp_calib_formats.reading import FileFormat, naming
from opencsp_calib_formats.safe_text import head, parse_json, read_text
from opencsp_calib_formats.scaramuzza import scaramuzza

__all__ = ["Matlab"]

MAPPING = "MappingCoefficients"
KINDS = ("RadialDistortion", "DistortionCoefficients", MAPPING)
MATRICES = ("K", "IntrinsicMatrix")
ORIGIN = 1.0
MAX_DEPTH = 12


class Matlab(FileFormat):
    """Reads all cameras of a file, those of stereo parameters included."""

    name = "matlab"
    title = "MATLAB cameraParameters, cameraIntrinsics (.mat, JSON)"
    extensions = (".mat", ".json")
    models = ("opencv4", "opencv5", "opencv_fisheye")
    fitted = ("skew", "fisheyeIntrinsics")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        if not is_mat(path):
            text = head(path)
            return text.lstrip().startswith("{") and any(f'"{kind}"' in text for kind in KINDS)
        try:
            return next(_cameras(read_mat(path), "", 0), None) is not None
        except FileFormatError:
            return False

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            content = read_mat(path) if is_mat(path) else parse_json(read_text(path))
            found: dict[str, Fields] = {}
            for key, fields in _cameras(content, "", 0):
                found.setdefault(key, fields)
            if not found:
                raise FileFormatError("holds no camera parameters or intrinsics of MATLAB's")
            named = _named(_distinct(found), content)
            single = len(named) == 1
            return each_camera(named, lambda key, f: _imported(path.stem if single else f"{path.stem} {key}", f))


def _cameras(value: Any, key: str, depth: int) -> Iterator[tuple[str, Fields]]:
    """The structures that are cameras, and where they are: ``stereoParams.CameraParameters1``."""
    if depth > MAX_DEPTH:
        return
    if isinstance(value, Mapping):
        if any(kind in value for kind in KINDS) and any(m in value for m in (*MATRICES, "FocalLength", MAPPING)):
            yield key or "camera", Fields(value, key)
            return
        items: Any = value.items()
    elif isinstance(value, Opaque):
        items = [("object", value.content)]
    elif isinstance(value, list):
        items = ((str(index + 1), item) for index, item in enumerate(value))
    else:
        return
    for name, item in items:
        yield from _cameras(item, f"{key}.{name}" if key else str(name), depth + 1)


def _distinct(found: Mapping[str, Fields]) -> dict[str, Fields]:
    """The same without what is there twice, as in a session, which keeps its camera in several places."""
    kept: dict[str, Fields] = {}
    seen: set[str] = set()
    for key, fields in found.items():
        text = repr([(name, _listed(fields.values[name])) for name in _identity(fields)])
        if text not in seen:
            seen.add(text)
            kept[key] = fields
    return kept


def _listed(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.ndarray) else value


def _identity(fields: Fields) -> list[str]:
    return [name for name in (*MATRICES, "FocalLength", "PrincipalPoint", "ImageSize", *KINDS) if name in fields]


def _named(cameras: Mapping[str, Fields], content: Any) -> list[tuple[str, Fields]]:
    """Saved objects have the name of their variable where there is one, else ``camera``."""
    inside = [key for key in cameras if key.split(".")[0] == OBJECTS]
    if not inside:
        return list(cameras.items())
    variables = [key for key, value in content.items() if isinstance(value, Opaque)]
    variable = variables[0] if len(variables) == 1 else "camera"
    named = []
    for key, fields in cameras.items():
        last = key.rpartition(".")[2]
        own = f"{variable}.{last}" if last.startswith("CameraParameters") else variable
        named.append((own if key in inside else key, fields))
    return named


def _imported(name: str, fields: Fields) -> Imported:
    size = _image_size(fields)
    if MAPPING in fields:
        return _scaramuzza(name, fields, size)
    camera_matrix = _matrix(fields)
    camera_matrix[:2, 2] -= ORIGIN
    if "RadialDistortion" not in fields:
        coefficients = fields.numbers("DistortionCoefficients", 4)
        return opencv_camera(name, camera_matrix, coefficients, size, fisheye=True)
    radial = fields.numbers("RadialDistortion", 2, 3)
    p1, p2 = fields.numbers("TangentialDistortion", 2) if "TangentialDistortion" in fields else (0.0, 0.0)
    return opencv_camera(name, camera_matrix, np.array([*radial[:2], p1, p2, *radial[2:]]), size)


def _image_size(fields: Fields) -> tuple[int, int] | None:
    if _is_empty(fields.values.get("ImageSize")):
        return None
    rows, columns = (whole(side, fields.path("ImageSize")) for side in fields.numbers("ImageSize", 2))
    return columns, rows


def _is_empty(value: Any) -> bool:
    """Whether there is nothing: no field, or MATLAB's ``[]``."""
    return value is None or (value.size == 0 if isinstance(value, np.ndarray) else value == [])


def _matrix(fields: Fields) -> Floats:
    """The camera matrix, still 1-based; of two names and orientations, or of focal length, principal point and skew."""
    key = fields.first(*MATRICES)
    if key is None:
        fx, fy = fields.numbers("FocalLength", 1, 2)[[0, -1]]
        cx, cy = fields.numbers("PrincipalPoint", 2)
        return np.array([[fx, _skew(fields), cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    found = fields.matrix(key, 3, 3) if isinstance(fields.raw(key), list) else fields.numbers(key, 9).reshape(3, 3)
    upright, turned = (found[2] == (0, 0, 1)).all(), (found[:, 2] == (0, 0, 1)).all()
    if upright == turned:
        raise FileFormatError(f"{fields.path(key)} is no camera matrix with a principal point, in either orientation")
    return np.array(found if upright else found.T)


def _skew(fields: Fields) -> float:
    """An array of one number in .mat files, a bare number in JSON, or nothing."""
    value = fields.values.get("Skew")
    if _is_empty(value):
        return 0.0
    return fields.number("Skew") if isinstance(value, int | float) else float(fields.numbers("Skew", 1)[0])


def _scaramuzza(name: str, fields: Fields, size: tuple[int, int] | None) -> Imported:
    mapping = fields.numbers(MAPPING, 4)
    centre = fields.numbers("DistortionCenter", 2) - ORIGIN
    stretch = fields.matrix("StretchMatrix", 2, 2) if "StretchMatrix" in fields else np.eye(2)
    Camera(name, "pinhole", np.array([mapping[0], mapping[0], *centre]), size or (1, 1))  # a0 is its focal length
    if not np.linalg.det(stretch) > 0:
        raise FileFormatError(f"{fields.path('StretchMatrix')} turns the image over")
    obstacle = "MappingCoefficients (Scaramuzza's fisheye model)"
    return not_exactly((obstacle,), lambda points: scaramuzza(points, mapping) @ stretch.T + centre, size)
