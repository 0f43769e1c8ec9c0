"""HALCON's internal camera parameters (``write_cam_par``): in metres on the sensor, correcting what was measured.

With (u', v') measured and (u, v) = Focus (X/Z, Y/Z), both in metres, and r² = u'² + v'²::

    division:   u = u' / (1 + Kappa r²)
    polynomial: u = u' (1 + Poly1 r² + Poly2 r⁴ + Poly3 r⁶) + Poly4 (r² + 2 u'²) + 2 Poly5 u' v', v likewise
    column = u' / Sx + Cx,  row = v' / Sy + Cy

from the centre of the first pixel. Source: HALCON reference, chapter "Calibration"; the order of Poly4 and Poly5 is
that of two independent converters.
"""

import re
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from opencsp_calib import Problem
from opencsp_calib.arrays import Floats, Points
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.lens import INVERSE, division, inverse_brown, on_plane
from opencsp_calib_formats.other_camera import other_camera
from opencsp_calib_formats.reading import FileFormat, naming, unverified
from opencsp_calib_formats.safe_text import head, once, read_text

__all__ = ["Halcon"]

GROUP = re.compile(r"^[ \t]*ParGroup[ \t]*:[ \t]*Cam", re.MULTILINE)
ENTRY = re.compile(r"^[ \t]*(\w+)[ \t]*:[ \t]*(?:\w+[ \t]*)?:([^;\n]+);", re.MULTILINE)
POLYNOMIAL = ("Poly1", "Poly2", "Poly3", "Poly4", "Poly5")
OTHER_CAMERAS = ("Magnification", "Tilt", "Rot", "ImagePlaneDist", "Vx", "Vy", "Vz", "SensorType", "HyperFocus")
LINES_BETWEEN = ("ParGroup", "DOUBLE", "INT", "STRING")
AREA_SCAN = ("area_scan_division", "area_scan_polynomial")
ORDER = unverified("Poly4 and Poly5 are taken in the order that two converters agree on, which was not verified")


class Halcon(FileFormat):
    """Reads the camera of a file."""

    name = "halcon"
    title = "HALCON camera parameters (.dat, .cal)"
    extensions = (".dat", ".cal")
    models = ("pinhole",)
    fitted = ("division", "polynomial")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        return GROUP.search(text) is not None and "Focus" in text

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            entries = ENTRY.findall(read_text(path))
            values = once((key, value.strip()) for key, value in entries if key not in LINES_BETWEEN)
            return {"camera": _imported(Fields(values))}


def _imported(fields: Fields) -> Imported:
    size = fields.size("ImageWidth", "ImageHeight")
    kind = fields.first("CamType", "CameraType")
    others = [key for key in OTHER_CAMERAS if key in fields]
    if kind is not None and fields.text(kind).strip('"') not in AREA_SCAN:
        others.append(fields.text(kind))
    if others:
        return not_exactly((f"{', '.join(others)} (not an ordinary area scan camera)",), None, size)
    focus, sx, sy = (fields.positive(key) for key in ("Focus", "Sx", "Sy"))
    intrinsics = (focus / sx, focus / sy, fields.number("Cx"), fields.number("Cy"))
    kappa = fields.number("Kappa", 0.0)
    poly = [fields.number(key, 0.0) for key in POLYNOMIAL]
    if not kappa and not any(poly):
        return as_imported("camera", "pinhole", np.array(intrinsics), size)
    plane, obstacles, notes = _distortion(kappa, poly, focus)
    return other_camera("camera", obstacles, plane, intrinsics, size, notes)


def _distortion(
    kappa: float, poly: list[float], focus: float
) -> tuple[Callable[[Points], Floats], tuple[str, ...], tuple[Problem, ...]]:
    """The plane's coordinates, with the obstacles and notes; coefficients per metre become those of the plane."""
    if kappa and any(poly):
        raise FileFormatError("has both Kappa and Poly coefficients")
    if kappa:
        k = kappa * focus**2
        return lambda p: division(on_plane(p), k), (f"Kappa = {kappa:g} (division model: {INVERSE})",), ()
    radial = [poly[i] * focus ** (2 * i + 2) for i in range(3)]
    tangential = (poly[4] * focus, poly[3] * focus)
    named = ", ".join(f"{key} = {value:g}" for key, value in zip(POLYNOMIAL, poly, strict=True) if value)
    notes = (ORDER,) if any(poly[3:]) else ()
    return lambda p: inverse_brown(on_plane(p), radial, tangential), (f"{named} ({INVERSE})",), notes
