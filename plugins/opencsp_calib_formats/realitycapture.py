"""RealityCapture and RealityScan: the XMP file beside each photograph.

With L the larger image side, x = X/Z and y = Y/Z distorted by ``brown``::

    u = f/36 L x + w/2 + U L,  v = f/36 L y + h/2 + V L

from the image's corner, as far as is known: 0.5 is taken off. f is FocalLength35mm, U and V the PrincipalPoint. The six
coefficients are k1 k2 k3 k4 t1 t2; t1 and t2 are OpenCV's p2 and p1, k4 is a term in r⁸. Source: Capturing Reality,
"RealityCapture XMP camera math"; the order of t1 and t2 from the OpenCV-compliant export that comes with the program.
The file does not have the image size.
"""

from collections.abc import Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from opencsp_calib import Problem
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.lens import brown, on_plane
from opencsp_calib_formats.other_camera import needing_size, other_camera
from opencsp_calib_formats.reading import FileFormat, naming, not_a_result, unverified
from opencsp_calib_formats.safe_text import head, parse_xml, read_bytes

__all__ = ["RealityCapture"]

NAMESPACE = "capturingreality.com/ns/xcr"
FULL_FRAME_MM = 36.0
RADIAL_TERMS = {"perspective": 0, "brown3": 3, "brown3t2": 3, "brown4": 4, "brown4t2": 4}

HALF_PIXEL = unverified(
    "RealityCapture's pixel origin is taken to be the image's corner, which was not verified; if it is the centre of "
    "the first pixel, cx and cy are 0.5 px too small. Nor does the file say whether it describes the photograph as "
    "taken or as exported without distortion"
)
ORDER = unverified("t1 and t2 are taken to be OpenCV's p2 and p1, as other people found; it was not verified")


class RealityCapture(FileFormat):
    """Reads the camera of a photograph; the image size has to be given."""

    name = "realitycapture"
    title = "RealityCapture and RealityScan (XMP)"
    extensions = (".xmp",)
    models = ("pinhole", "opencv5")
    fitted = ("k4",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        return NAMESPACE in head(path)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`; the camera is called as the file."""
        with naming(path):
            fields = _fields(parse_xml(read_bytes(path)))
            if fields.first("FocalLength35mm") is None:
                raise FileFormatError("holds no calibration, only a pose: export XMP with calibration")
            return {path.stem: _imported(path.stem, fields)}


def _fields(root: Element) -> Fields:
    """What is in RealityCapture's namespace, be it an attribute or an element."""
    values: dict[str, str] = {}
    for element in root.iter():
        items = [*element.attrib.items(), (str(element.tag), element.text or "")]
        for name, value in items:
            namespace, _, key = name.rpartition("}")
            if NAMESPACE in namespace and values.setdefault(key, value) != value:
                raise FileFormatError(f"{key} is there twice with different values: more than one photograph's?")
    return Fields(values)


def _imported(name: str, fields: Fields) -> Imported:
    model = fields.text("DistortionModel", "perspective")
    d = _coefficients(fields, model)
    obstacles = _obstacles(fields, model, d)
    notes = _notes(fields, d)
    if obstacles and not (len(obstacles) == 1 and obstacles[0].startswith("k4")):
        return not_exactly(obstacles, None, None, notes)
    f, u, v = fields.number("FocalLength35mm"), *(fields.number(f"PrincipalPoint{a}", 0.0) for a in "UV")
    k1, k2, k3, k4, t1, t2 = (float(value) for value in d)

    def of_size(size: tuple[int, int]) -> Imported:
        side = max(size)
        fx, cx, cy = f / FULL_FRAME_MM * side, size[0] / 2 + u * side - 0.5, size[1] / 2 + v * side - 0.5
        if obstacles:
            return other_camera(
                name,
                obstacles,
                lambda p: brown(on_plane(p), (k1, k2, k3, k4), (t2, t1)),
                (fx, fx, cx, cy),
                size,
                notes,
            )
        if not d.any():
            return as_imported(name, "pinhole", np.array([fx, fx, cx, cy]), size, notes)
        return as_imported(name, "opencv5", np.array([fx, fx, cx, cy, k1, k2, t2, t1, k3]), size, notes)

    return needing_size(None, of_size)


def _coefficients(fields: Fields, model: str) -> np.ndarray:
    """k1 k2 k3 k4 t1 t2; the field's name is misspelt by RealityCapture, and might one day not be."""
    name = fields.first("DistortionCoeficients", "DistortionCoefficients")
    if name is None and model != "perspective" and fields.text("CalibrationPrior", "") != "initial":
        raise FileFormatError(f"DistortionModel is {model}, but there are no DistortionCoeficients")
    return np.zeros(6) if name is None else fields.numbers(name, 6)


def _obstacles(fields: Fields, model: str, d: np.ndarray) -> tuple[str, ...]:
    found = []
    skew, aspect = fields.number("Skew", 0.0), fields.number("AspectRatio", 1.0)
    if skew != 0:
        found.append(f"Skew = {skew:g} (our models have none)")
    if aspect != 1:
        found.append(f"AspectRatio = {aspect:g} (which axis it scales is not known)")
    if model not in RADIAL_TERMS and d.any():
        found.append(f"DistortionModel {model} with {d.tolist()} (no lens model of ours)")
    elif model in RADIAL_TERMS:
        used = [*range(RADIAL_TERMS[model]), *([4, 5] if model.endswith("t2") else [])]
        if np.delete(d, used).any():
            found.append(f"DistortionModel {model} with {d.tolist()}: it does not have that many terms")
        elif d[3] != 0:
            found.append(f"k4 = {d[3]:g} (a term in r^8 that opencv models do not have)")
    return tuple(found)


def _notes(fields: Fields, d: np.ndarray) -> tuple[Problem, ...]:
    notes = [HALF_PIXEL]
    if d[4:].any():
        notes.append(ORDER)
    if fields.text("CalibrationPrior", "") == "initial" and not d.any():
        notes.append(not_a_result('CalibrationPrior="initial" and no distortion: what RealityCapture is to start from'))
    return tuple(notes)
