"""JPL's .cahvor files, and the CAHV files with OpenCV coefficients that mrcal writes under the same name.

C is where the camera stands, A its axis; ``H = fx H' + cx A`` and ``V = fy V' + cy A`` with unit vectors H', V' along
the image's rows and columns. So ``cx = H·A``, ``fx = |H - cx A|``; H', V', A are the camera's frame, and O, the axis of
the distortion, is taken into that frame. Skew is the lack of a right angle between H' and V'.

Source: Y. Yakimovsky and R. Cunningham, "A system for extracting three-dimensional measurements from a stereo pair of
TV cameras", 1978; mrcal documentation, module ``cahvor``.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.mrcal_models import imported
from opencsp_calib_formats.reading import FileFormat, naming
from opencsp_calib_formats.safe_text import head, read_text

__all__ = ["Cahvor"]

RIGHT_ANGLE = 1e-6  # files have 10 decimals: a smaller deviation is their rounding
ROUNDING = 1e-9  # O differs from A by no more than this where it was written as the same
OPENCV = ("LENSMODEL_OPENCV12", "LENSMODEL_OPENCV8", "LENSMODEL_OPENCV5", "LENSMODEL_OPENCV4")


class Cahvor(FileFormat):
    """Reads one camera."""

    name = "cahvor"
    title = "JPL CAHV, CAHVOR, CAHVORE (.cahvor, .cahv)"
    extensions = (".cahvor", ".cahv", ".cahvore")
    models = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv12")
    fitted = ("CAHVOR off axis", "CAHVORE")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        return all(re.search(rf"^[ \t]*{key}[ \t]*=", text, re.MULTILINE) for key in ("Dimensions", "C", "A", "H", "V"))

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            fields = Fields(_values(read_text(path)))
            return {"camera": _imported(path.stem, fields, fields.size_pair("Dimensions"))}


def _values(text: str) -> dict[str, str]:
    values: dict[str, str] = {}
    for line in text.splitlines():
        match = re.match(r"\s*(\w+)\s*=\s*(.*\S)", line)
        if match and values.setdefault(match[1], match[2]) != match[2]:
            raise FileFormatError(f"{match[1]} is there twice with different values")
    return values


def _imported(name: str, fields: Fields, image_size: tuple[int, int]) -> Imported:
    a, h, v = (fields.numbers(key, 3) for key in "AHV")
    if abs(np.linalg.norm(a) - 1.0) > RIGHT_ANGLE:
        raise FileFormatError("A is not a unit vector")
    cx, cy = float(h @ a), float(v @ a)
    across, down = h - cx * a, v - cy * a
    fx, fy = float(np.linalg.norm(across)), float(np.linalg.norm(down))
    if not min(fx, fy) > 0:
        raise FileFormatError("H or V is along A: no focal length")
    frame = np.stack([across / fx, down / fy, a])
    if not np.linalg.det(frame) > 0:
        raise FileFormatError("H, V and A are not x right, y down, z forward")
    if abs(frame[0] @ frame[1]) > RIGHT_ANGLE:
        degrees = np.degrees(np.arccos(frame[0] @ frame[1]))
        return not_exactly((f"skew: {degrees:.6g} degrees between H and V",), None, image_size)
    lensmodel, coefficients = _lens(fields, frame)
    return imported(name, lensmodel, np.array([fx, fy, cx, cy, *coefficients]), image_size)


def _lens(fields: Fields, frame: Floats) -> tuple[str, Floats]:
    opencv = fields.first(*OPENCV, *(key.replace("LENSMODEL", "DISTORTION") for key in OPENCV))
    if opencv is not None:
        return opencv, fields.numbers(opencv)
    if "R" not in fields:
        return "LENSMODEL_PINHOLE", np.zeros(0)
    radial = fields.numbers("R", 3)
    alpha, beta = 0.0, 0.0
    if "O" in fields:
        o = frame @ fields.numbers("O", 3)
        if abs(np.linalg.norm(o) - 1.0) > RIGHT_ANGLE:
            raise FileFormatError("O is not a unit vector")
        if np.hypot(o[0], o[1]) > ROUNDING or o[2] < 0:
            alpha, beta = float(np.arctan2(o[0], o[2])), float(np.arcsin(np.clip(o[1], -1.0, 1.0)))
    if "E" not in fields:
        if not radial.any():
            return "LENSMODEL_PINHOLE", np.zeros(0)
        return "LENSMODEL_CAHVOR", np.array([alpha, beta, *radial])
    match = re.match(r"CAHVORE3,\s*([-+.\deE]+)", fields.text("Model", ""))
    if match is None:
        raise FileFormatError("has E, but Model is not CAHVORE3,LINEARITY")
    return f"LENSMODEL_CAHVORE_linearity={match[1]}", np.array([alpha, beta, *radial, *fields.numbers("E", 3)])
