"""Pix4D: ``..._calibrated_internal_camera_parameters.cam`` and ``..._calibrated_camera_parameters.txt``.

Both carry x_d = (1 + R1 r² + R2 r⁴ + R3 r⁶) x + 2 T1 x y + T2 (r² + 2 x²), OpenCV's formula. The .cam file is in
millimetres of a sensor whose size is in its header, without the size in pixels; the .txt file in pixels, for each
photograph. Coordinates count from the image's corner, as far as is known: 0.5 is taken off. Source: Pix4D support, "How
are the internal and external camera parameters defined"; EasyIDP, ``pix4d.py``.
"""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from opencsp_calib import InputError
from opencsp_calib.counted import counted
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields, matrix, number, numbers, whole
from opencsp_calib_formats.opencv_camera import opencv_camera
from opencsp_calib_formats.other_camera import each_camera, needing_size
from opencsp_calib_formats.reading import FileFormat, naming, unverified
from opencsp_calib_formats.safe_text import head, once, read_text

__all__ = ["Pix4D"]

CAM, TXT = "Pix4D camera calibration file", "fileName imageWidth imageHeight"
SENSOR = re.compile(r"sensor width of\s*([0-9.eE+-]+)\s*x\s*([0-9.eE+-]+)\s*mm")
TERMS = ("K1", "K2", "T1", "T2", "K3")
BLOCK = 10  # lines a photograph: name and size, K, radial, tangential, position, R
ASPECT = 1e-3  # by how much pixels may differ from square: the header has few digits

HALF_PIXEL = unverified(
    "Pix4D's pixel origin is taken to be the image's corner, which was not verified; if it is the centre of the first "
    "pixel, cx and cy are 0.5 px too small"
)


class Pix4D(FileFormat):
    """Reads both files."""

    name = "pix4d"
    title = "Pix4D (.cam, calibrated_camera_parameters.txt)"
    extensions = (".cam", ".txt")
    models = ("opencv5",)
    fitted = ("skew",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        return head(path, 256).lstrip().startswith((CAM, TXT))

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`; cameras of a .cam file by their number, others by the first photograph they took."""
        with naming(path):
            text = read_text(path).lstrip()
            return _of_cam(text) if text.startswith(CAM) else _of_txt(text)


def _of_cam(text: str) -> dict[str, Imported]:
    sections = text.split(CAM)[1:]
    named = ((section.partition("\n")[0].strip()[:40] or "camera", section) for section in sections)
    return each_camera(named, _of_section)


def _of_section(name: str, section: str) -> Imported:
    lines = [line.split() for line in section.split("\n")[1:] if line.strip() and not line.startswith("#")]
    fields = Fields(once((words[0], words[1]) for words in lines if len(words) == 2), f"camera {name}")
    if "F" not in fields or "K1" not in fields:
        return not_exactly(("no F and K1: a fisheye (no lens model of ours)",), None, None, (HALF_PIXEL,))
    f, px, py = (fields.number(key) for key in ("F", "Px", "Py"))
    d = [fields.number(key, 0.0) for key in TERMS]
    sensor = SENSOR.search(section)
    if sensor is None:
        raise FileFormatError(f"camera {name} does not say the sensor's width in millimetres")
    width_mm, height_mm = (number(side, "the sensor's size") for side in sensor.groups())
    if not (width_mm > 0 and height_mm > 0):
        raise FileFormatError(f"camera {name}: a sensor of {width_mm:g}x{height_mm:g} mm")

    def of_size(size: tuple[int, int]) -> Imported:
        pitch = width_mm / size[0]
        if abs(height_mm / size[1] / pitch - 1) > ASPECT:
            shape = f"{width_mm:g}x{height_mm:g} mm"
            raise InputError(f"images of {size[0]}x{size[1]} pixels have not the shape of the sensor, {shape}")
        params = np.array([f / pitch, f / pitch, px / pitch - 0.5, py / pitch - 0.5, *d])
        return as_imported(name, "opencv5", params, size, (HALF_PIXEL,))

    return needing_size(None, of_size, nominal=_nominal(width_mm, height_mm))


def _nominal(width_mm: float, height_mm: float) -> tuple[int, int]:
    larger = max(width_mm, height_mm)
    return max(1, round(1e5 * width_mm / larger)), max(1, round(1e5 * height_mm / larger))


def _of_txt(text: str) -> dict[str, Imported]:
    header, _, body = text.partition("camera model")
    if "radial distortion" not in header:
        raise FileFormatError("the header names no radial distortion: a fisheye's parameters, which we cannot read")
    lines = [line for line in body.split("\n")[1:] if line.strip()]
    if not lines or len(lines) % BLOCK:
        raise FileFormatError(f"{counted(len(lines), 'line')} of photographs, expected {BLOCK} for each: truncated?")
    different = {found: name for name, found in reversed(list(_photographs(lines)))}
    named = ((name, found) for found, name in reversed(different.items()))
    return each_camera(named, lambda name, found: _of_numbers(name, *found))


Found = tuple[tuple[int, int], tuple[float, ...], tuple[float, ...]]


def _photographs(lines: list[str]) -> Iterator[tuple[str, Found]]:
    """Name, and size, camera matrix and distortion."""
    for start in range(0, len(lines), BLOCK):
        words = lines[start].split()
        if len(words) < 3:
            raise FileFormatError(f"expected a name and an image size: {lines[start][:60]!r}")
        name = " ".join(words[:-2])
        size = whole(words[-2], f"{name}: width"), whole(words[-1], f"{name}: height")
        k = numbers(" ".join(lines[start + 1 : start + 4]), f"{name}: camera matrix", 9)
        r1, r2, r3 = numbers(lines[start + 4], f"{name}: radial distortion", 3)
        t1, t2 = numbers(lines[start + 5], f"{name}: tangential distortion", 2)
        yield name, (size, tuple(k), (r1, r2, t1, t2, r3))


def _of_numbers(name: str, size: tuple[int, int], k: tuple[float, ...], d: tuple[float, ...]) -> Imported:
    camera_matrix = matrix(list(k), f"{name}: camera matrix", 3, 3)
    camera_matrix[:2, 2] -= 0.5
    return opencv_camera(name, camera_matrix, np.array(d), size, notes=(HALF_PIXEL,))
