"""calib.io's Calibrator: the cameras of a project or an exported calibration.

A dump of C++ objects by cereal: the name of a class stands only where it is first met, later there is its number. fx =
f, fy = f ar; the coefficients are OpenCV's, by name. The centre of the upper-left pixel is taken to be (0, 0), as
OpenCV's. Source: calib.io, ``readCalibParameters.cpp``.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib.models import OPENCV_MODELS
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.other_camera import each_camera
from opencsp_calib_formats.reading import FileFormat, naming, unverified
from opencsp_calib_formats.safe_text import MAX_BYTES, head, parse_json, read_text

__all__ = ["CalibIo", "class_names"]

COEFFICIENTS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tauX", "tauY")
OPENCV = "libCalib::CameraModelOpenCV"
FIRST = 1 << 31  # of a polymorphic_id: the class's name stands beside it
ROOTS = ("Calibration", "calibration")

HALF_PIXEL = unverified(
    "calib.io does not document where its pixels' origin is; OpenCV's is taken: if it is the image's corner, cx and cy "
    "are 0.5 px too large"
)


class CalibIo(FileFormat):
    """Reads all cameras, by their number."""

    name = "calibio"
    title = "calib.io Calibrator (JSON)"
    extensions = (".json",)
    models = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv12", "opencv14")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        return head(path, 64).lstrip().startswith("{") and '"libCalib::' in head(path, MAX_BYTES)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            content = Fields(parse_json(read_text(path)))
            root = content.first(*ROOTS)
            if root is None:
                raise FileFormatError("no Calibration in it")
            models = [camera.fields("model") for camera in content.fields(root).each("cameras")]
            found = zip(models, class_names(models), strict=True)
            named = ((str(i), model) for i, model in enumerate(found))
            return each_camera(named, lambda name, model: _imported(name, *model))


def class_names(objects: list[Fields]) -> list[str]:
    """The class of each object that cereal dumped through a pointer."""
    by_id: dict[int, str] = {}
    names = []
    for fields in objects:
        key = fields.whole("polymorphic_id", 0) % FIRST
        if fields.first("polymorphic_name"):
            by_id[key] = fields.text("polymorphic_name")
        names.append(by_id.get(key, ""))
    return names


def _imported(name: str, model: Fields, kind: str) -> Imported:
    data = model.fields("ptr_wrapper").fields("data")
    size = _size(data.values)
    if kind != OPENCV:
        return not_exactly((f"{kind or 'a camera model without a name'} (no lens model of ours)",), None, size)
    parameters = data.fields("parameters")
    f, ar, cx, cy = (_value(parameters, key) for key in ("f", "ar", "cx", "cy"))
    d = np.array([_value(parameters, key, 0.0) for key in COEFFICIENTS])
    count = next(n for n in OPENCV_MODELS if not d[n:].any())
    params = np.array([f, f * ar, cx, cy, *d[:count]])
    return as_imported(name, OPENCV_MODELS[count], params, size, (HALF_PIXEL,))


def _value(parameters: Fields, key: str, default: float | None = None) -> float:
    if default is not None and key not in parameters:
        return default
    if isinstance(parameters.raw(key), dict):
        return parameters.fields(key).number("val")
    return parameters.number(key)


def _size(data: Any) -> tuple[int, int] | None:
    """The image size, which has moved between versions: wherever within the model it is."""
    level = [data]
    while level:
        for values in level:
            if "imageSize" in values:
                return Fields(values["imageSize"], "imageSize").size("width", "height")
        level = [child for values in level for child in values.values() if isinstance(child, dict)]
    return None
