"""Calib_Results of Bouguet's Camera Calibration Toolbox for MATLAB, mono and stereo: .mat and .m.

``fc`` and ``cc`` are focal lengths and principal point in pixels, ``kc`` are k1 k2 p1 p2 k3 in OpenCV's order, and
although this is MATLAB the centre of the upper-left pixel is (0, 0): the toolbox takes 1 from what it clicks. The skew
is ``alpha_c fc(1)``; ``nx`` and ``ny`` are the image size.

Trap: old files have 4 entries in ``kc``, and so has the toolbox's fisheye variant, of another model.

Source: J.-Y. Bouguet, "Camera Calibration Toolbox for Matlab", "Description of the calibration parameters".
"""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib.errors import FileFormatError
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields, whole
from opencsp_calib_formats.mat_file import is_mat, read_mat
from opencsp_calib_formats.opencv_camera import either_model, opencv_camera
from opencsp_calib_formats.reading import FileFormat, naming
from opencsp_calib_formats.safe_text import head, read_text, set_once

__all__ = ["Bouguet"]

ENDS = {"": "camera", "_left": "left", "_right": "right"}
ASSIGNMENT = re.compile(r"^[ \t]*(\w+)[ \t]*=[ \t]*(\[[^\]\n%]*\]|[-+.\deE]+)[ \t]*;", re.MULTILINE)
MAX_BYTES = 16 * 2**20


class Bouguet(FileFormat):
    """Reads one camera, or both of a stereo pair."""

    name = "bouguet"
    title = "Bouguet's toolbox, Calib_Results (.mat, .m)"
    extensions = (".mat", ".m")
    models = ("opencv4", "opencv5", "opencv_fisheye")
    fitted = ("skew",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        if not is_mat(path):
            names = {match[1] for match in ASSIGNMENT.finditer(_joined(head(path)))}
        else:
            try:
                names = set(read_mat(path))
            except FileFormatError:
                return False
        return any({f"fc{end}", f"cc{end}", f"kc{end}"} <= names for end in ENDS)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            if is_mat(path):
                values = read_mat(path)
                fisheye = any("fisheye" in name.lower() for name in values)
            else:
                text = read_text(path, MAX_BYTES)
                values = _assigned(_joined(text))
                fisheye = "fisheye" in text.lower()
            fields = Fields(values)
            cameras: dict[str, Imported] = {}
            for end, key in ENDS.items():
                if f"fc{end}" in fields:
                    cameras |= _cameras(path.stem, key, end, fields, fisheye=fisheye)
            if not cameras:
                raise FileFormatError("has no fc")
            return cameras


def _joined(text: str) -> str:
    """Lines that ``...`` continues, as one."""
    return re.sub(r"\.\.\.[^\n]*(?:\n|\Z)", " ", text)


def _assigned(text: str) -> dict[str, Any]:
    values: dict[str, Any] = {}
    for match in ASSIGNMENT.finditer(text):
        value = re.split(r"[\s;,]+", match[2].strip("[] \t;,"))
        set_once(values, match[1], value)
    return values


def _cameras(stem: str, key: str, end: str, fields: Fields, *, fisheye: bool) -> dict[str, Imported]:
    fx, fy = fields.numbers(f"fc{end}", 2)
    cx, cy = fields.numbers(f"cc{end}", 2)
    alpha = fields.numbers(f"alpha_c{end}", 1)[0] if f"alpha_c{end}" in fields else 0.0
    kc = fields.numbers(f"kc{end}", 4, 5)
    camera_matrix = np.array([[fx, alpha * fx, cx], [0.0, fy, cy], [0.0, 0.0, 1.0]])
    name = f"{stem} {key}" if end else stem
    size = _image_size(fields)
    if len(kc) == 4 and not fisheye:
        why = f"kc{end} has 4 entries, as in old files and in those of the fisheye variant"
        return either_model(key if end else "", name, camera_matrix, kc, size, why)
    return {key: opencv_camera(name, camera_matrix, kc, size, fisheye=fisheye)}


def _image_size(fields: Fields) -> tuple[int, int] | None:
    if "nx" not in fields or "ny" not in fields:
        return None
    nx, ny = (whole(fields.numbers(side, 1)[0], side) for side in ("nx", "ny"))
    return nx, ny
