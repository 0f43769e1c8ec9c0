"""camodocal and those who use its cameras: VINS-Mono, VINS-Fusion and many more (YAML with ``model_type``).

PINHOLE is OpenCV's model with four coefficients; KANNALA_BRANDT's k2 to k5 are OpenCV's fisheye k1 to k4; MEI is the
unified omnidirectional model with radial and tangential terms; SCARAMUZZA is ``ocam``. The centre of the upper-left
pixel is taken to be (0, 0), as OpenCV's. Source: camodocal, ``camera_models/*Camera.cc``.
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from opencsp_calib.arrays import Pixels, Points
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.lens import brown, ocam, omni
from opencsp_calib_formats.other_camera import Size, other_camera
from opencsp_calib_formats.reading import FileFormat, naming
from opencsp_calib_formats.safe_text import head, read_text
from opencsp_calib_formats.safe_yaml import parse_yaml

__all__ = ["Camodocal"]

RADTAN = ("k1", "k2", "p1", "p2")


class Camodocal(FileFormat):
    """Reads the camera of a file."""

    name = "camodocal"
    title = "camodocal, VINS (YAML)"
    extensions = (".yaml", ".yml")
    models = ("opencv4", "opencv8", "opencv_fisheye")
    fitted = ("MEI", "SCARAMUZZA")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        return any(line.startswith("model_type") for line in head(path).splitlines())

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            documents = [document for document in parse_yaml(read_text(path)) if isinstance(document, dict)]
            if len(documents) != 1:
                raise FileFormatError(f"{len(documents)} YAML documents with named values, expected one")
            fields = Fields(documents[0])
            name = fields.text("camera_name", "") or "camera"
            return {name: _imported(name, fields)}


def _imported(name: str, fields: Fields) -> Imported:
    kind = fields.text("model_type").upper()
    size = fields.size("image_width", "image_height")
    readers: Mapping[str, Callable[[str, Fields, Size], Imported]] = {
        "PINHOLE": _pinhole,
        "PINHOLE_FULL": _pinhole_full,
        "KANNALA_BRANDT": _kannala_brandt,
        "MEI": _mei,
        "SCARAMUZZA": _scaramuzza,
    }
    if kind not in readers:
        return not_exactly((f"model_type {kind} (no lens model of ours)",), None, size)
    return readers[kind](name, fields, size)


def _distortion(fields: Fields, names: tuple[str, ...]) -> list[float]:
    """Zeros where the file has no distortion at all."""
    if "distortion_parameters" not in fields:
        return [0.0] * len(names)
    return [fields.fields("distortion_parameters").number(name) for name in names]


def _intrinsics(fields: Fields, *names: str) -> list[float]:
    return [fields.fields("projection_parameters").number(name) for name in names]


def _pinhole(name: str, fields: Fields, size: Size) -> Imported:
    params = [*_intrinsics(fields, "fx", "fy", "cx", "cy"), *_distortion(fields, RADTAN)]
    return as_imported(name, "opencv4", np.array(params), size)


def _pinhole_full(name: str, fields: Fields, size: Size) -> Imported:
    names = (*RADTAN, "k3", "k4", "k5", "k6")
    params = [*_intrinsics(fields, "fx", "fy", "cx", "cy"), *_distortion(fields, names)]
    return as_imported(name, "opencv8", np.array(params), size)


def _kannala_brandt(name: str, fields: Fields, size: Size) -> Imported:
    names = ("k2", "k3", "k4", "k5")
    elsewhere = "distortion_parameters" in fields and not fields.fields("projection_parameters").first(*names)
    # converters from Kalibr put them there
    k = _distortion(fields, names) if elsewhere else _intrinsics(fields, *names)
    params = [*_intrinsics(fields, "mu", "mv", "u0", "v0"), *k]
    return as_imported(name, "opencv_fisheye", np.array(params), size)


def _mei(name: str, fields: Fields, size: Size) -> Imported:
    xi = fields.fields("mirror_parameters").number("xi")
    fx, fy, cx, cy = _intrinsics(fields, "gamma1", "gamma2", "u0", "v0")
    k1, k2, p1, p2 = d = _distortion(fields, RADTAN)
    if xi == 0:
        return as_imported(name, "opencv4", np.array([fx, fy, cx, cy, *d]), size)
    obstacle = f"xi = {xi:g} (the unified omnidirectional model)"
    return other_camera(name, (obstacle,), lambda p: brown(omni(p, xi), (k1, k2), (p1, p2)), (fx, fy, cx, cy), size)


def _scaramuzza(name: str, fields: Fields, size: Size) -> Imported:
    inverse = fields.fields("inv_poly_parameters")
    polynomial: list[float] = []
    while f"p{len(polynomial)}" in inverse:
        polynomial.append(inverse.number(f"p{len(polynomial)}"))
    if not polynomial:
        raise FileFormatError("inv_poly_parameters has no p0")
    ac, ad, ae, cx, cy = (fields.fields("affine_parameters").number(key) for key in ("ac", "ad", "ae", "cx", "cy"))
    affine, centre = np.array([[ac, ad], [ae, 1.0]]), np.array([cx, cy])

    def project(points: Points) -> Pixels:
        return np.asarray(ocam(points, polynomial) @ affine.T + centre, dtype=np.float64)

    return not_exactly(("Scaramuzza's polynomial (no lens model of ours)",), project, size)
