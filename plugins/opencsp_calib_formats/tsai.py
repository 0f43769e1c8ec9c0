"""Pinhole cameras of NASA's Ames Stereo Pipeline (``.tsai``).

fu, fv, cu, cv are in units of ``pitch``; TSAI's coefficients are OpenCV's k1 k2 p1 p2 [k3], FISHEYE's OpenCV's k1 to k4
and FOV's that of ``fov``. The centre of the upper-left pixel is taken to be (0, 0), which is not documented. Source:
Ames Stereo Pipeline documentation, "Frame camera models". There is no image size.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib.models import OPENCV_MODELS
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.lens import fov, on_plane
from opencsp_calib_formats.other_camera import other_camera
from opencsp_calib_formats.reading import FileFormat, naming, unverified
from opencsp_calib_formats.safe_text import head, once, read_text

__all__ = ["Tsai"]

AXES = {"u_direction": (1.0, 0.0, 0.0), "v_direction": (0.0, 1.0, 0.0), "w_direction": (0.0, 0.0, 1.0)}

HALF_PIXEL = unverified(
    "ASP's pixel origin is taken to be the centre of the first pixel, which was not verified; if it is the image's "
    "corner, cx and cy are 0.5 px too large"
)
BEFORE = unverified("p1 and p2 are OpenCV's from ASP 3.3.0 on; before, they were not quite, and the file does not say")


class Tsai(FileFormat):
    """Reads the camera of a file; the image size has to be given."""

    name = "tsai"
    title = "Ames Stereo Pipeline (.tsai)"
    extensions = (".tsai",)
    models = ("pinhole", "opencv4", "opencv5", "opencv_fisheye")
    fitted = ("FOV",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        names = {line.partition("=")[0].strip() for line in head(path).split("\n") if "=" in line}
        return {"fu", "fv", "cu", "cv"} <= names

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            lines = [line.strip() for line in read_text(path).split("\n")]
            entries = (line.partition("=") for line in lines if "=" in line)
            fields = Fields(once((name.strip(), value.strip()) for name, _, value in entries))
            words = [line for line in lines if line.isalpha() and line != "PINHOLE"]
            if len(words) > 1:
                raise FileFormatError(f"more than one lens distortion: {', '.join(words[:5])}")
            return {path.stem: _imported(path.stem, fields, words[0] if words else "TSAI")}


def _imported(name: str, fields: Fields, kind: str) -> Imported:
    for axis, default in AXES.items():
        if axis in fields and tuple(fields.numbers(axis, 3)) != default:
            return not_exactly((f"{axis} = {fields.text(axis)} (axes that are turned)",), None, None, (HALF_PIXEL,))
    pitch = fields.positive("pitch", 1.0)
    fx, fy, cx, cy = (fields.number(key) / pitch for key in ("fu", "fv", "cu", "cv"))
    if kind == "TSAI":
        d = [fields.number(key) for key in ("k1", "k2", "p1", "p2", *(("k3",) if "k3" in fields else ()))]
        notes = (HALF_PIXEL, BEFORE) if any(d[2:4]) else (HALF_PIXEL,)
        return as_imported(name, OPENCV_MODELS[len(d)], np.array([fx, fy, cx, cy, *d]), None, notes)
    if kind == "FISHEYE":
        d = [fields.number(key) for key in ("k1", "k2", "k3", "k4")]
        return as_imported(name, "opencv_fisheye", np.array([fx, fy, cx, cy, *d]), None, (HALF_PIXEL,))
    if kind == "NULL":
        return as_imported(name, "pinhole", np.array([fx, fy, cx, cy]), None, (HALF_PIXEL,))
    if kind != "FOV":
        return not_exactly((f"lens distortion {kind[:40]} (no lens model of ours)",), None, None, (HALF_PIXEL,))
    w = fields.number("k1")
    if not 0 < w < np.pi:
        raise FileFormatError(f"the field of view k1 is {w:g}, it must be within 0 and pi")
    obstacle = f"k1 = {w:g} (the field-of-view model)"
    return other_camera(name, (obstacle,), lambda p: fov(on_plane(p), w), (fx, fy, cx, cy), None, (HALF_PIXEL,))
