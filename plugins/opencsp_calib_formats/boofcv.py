"""BoofCV's cameras in YAML: pinhole, radial and tangential distortion, omnidirectional, Kannala-Brandt, stereo.

t1 and t2 are OpenCV's p1 and p2; Kannala-Brandt's first symmetric coefficient multiplies theta, so that
``f = fx s0, k_i = s_i / s0`` in OpenCV's fisheye model. Pixels count from the image's corner, as the end of BoofCV's
chessboard detector suggests and nothing documents. Source: BoofCV, ``CalibrationIO.java`` and
``CameraKannalaBrandt.java``.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from opencsp_calib.arrays import Floats, Points
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib.models import OPENCV_MODELS
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.lens import brown, equidistant, omni, on_plane
from opencsp_calib_formats.other_camera import Intrinsics, other_camera
from opencsp_calib_formats.reading import FileFormat, naming, unverified
from opencsp_calib_formats.safe_text import head, read_text
from opencsp_calib_formats.safe_yaml import parse_yaml

__all__ = ["BoofCV"]

WITHIN = {"left": ("left", "right"), "intrinsic": ("intrinsic",)}
"""Files that hold cameras with something else, by the field that tells."""

ASYMMETRIC = ("radial", "radial_trig", "tangent", "tangent_trig")

HALF_PIXEL = unverified(
    "BoofCV does not document its pixels' origin; the image's corner is taken, as its chessboard detector suggests: "
    "with other detectors, or old versions, cx and cy may be 0.5 px too small"
)


class BoofCV(FileFormat):
    """Reads the camera, or both of a stereo pair as ``left`` and ``right``."""

    name = "boofcv"
    title = "BoofCV (YAML)"
    extensions = (".yaml", ".yml")
    models = ("pinhole", "opencv4", "opencv5", "opencv_fisheye")
    fitted = ("skew", "over 3 radial terms", "omnidirectional")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        lines = [line.strip() for line in head(path).splitlines()]
        return "pinhole:" in lines and any(line.startswith("model:") for line in lines)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            documents = [document for document in parse_yaml(read_text(path)) if document]
            fields = Fields(documents[0] if len(documents) == 1 else None)
            names = next((names for field, names in WITHIN.items() if field in fields), ())
            if names:
                return {name: _imported(name, fields.fields(name)) for name in names}
            return {"camera": _imported("camera", fields)}


@dataclass(frozen=True)
class _Pinhole:
    """Intrinsics in our convention, skew in pixels, image size."""

    intrinsics: Intrinsics
    skew: float
    size: tuple[int, int]

    @property
    def obstacles(self) -> tuple[str, ...]:
        return (f"skew = {self.skew:g} px (our models have none)",) if self.skew else ()


def _imported(name: str, fields: Fields) -> Imported:
    kind = fields.text("model")
    values = fields.fields("pinhole")
    fx, fy, cx, cy = (values.number(key) for key in ("fx", "fy", "cx", "cy"))
    pinhole = _Pinhole((fx, fy, cx - 0.5, cy - 0.5), values.number("skew", 0.0), values.size("width", "height"))
    if kind == "kannala_brandt":
        return _kannala_brandt(name, fields, pinhole)
    if kind == "omnidirectional_universal":
        return _brown(name, fields, pinhole, fields.number("mirror_offset"))
    if kind in ("pinhole", "pinhole_radial_tangential"):
        return _brown(name, fields, pinhole, 0.0)
    return not_exactly((f"model {kind} (no lens model of ours)",), None, pinhole.size, (HALF_PIXEL,))


def _brown(name: str, fields: Fields, pinhole: _Pinhole, xi: float) -> Imported:
    terms = fields.fields("radial_tangential") if "radial_tangential" in fields else Fields({})
    radial = np.trim_zeros(_coefficients(terms, "radial"), "b").tolist()
    t1, t2 = terms.number("t1", 0.0), terms.number("t2", 0.0)
    obstacles = pinhole.obstacles
    if xi:
        obstacles += (f"mirror_offset = {xi:g} (the unified omnidirectional model)",)
    if len(radial) > 3:
        obstacles += (f"{len(radial)} radial terms (opencv models have 3)",)
    if obstacles:
        central = (lambda p: omni(p, xi)) if xi else on_plane
        return _other(name, obstacles, lambda p: brown(central(p), radial, (t1, t2)), pinhole)
    k1, k2, k3 = (*radial, 0.0, 0.0, 0.0)[:3]
    count = 5 if len(radial) == 3 else 4 if "radial_tangential" in fields else 0
    params = np.array([*pinhole.intrinsics, k1, k2, t1, t2, k3])[: 4 + count]
    return as_imported(name, OPENCV_MODELS[count], params, pinhole.size, (HALF_PIXEL,))


def _kannala_brandt(name: str, fields: Fields, pinhole: _Pinhole) -> Imported:
    symmetric = _coefficients(fields, "symmetric")
    if len(symmetric) == 0 or not symmetric[0] > 0:
        raise FileFormatError("symmetric is not a list that starts with a positive number")
    scale, k = symmetric[0], np.trim_zeros(symmetric[1:] / symmetric[0], "b").tolist()
    fx, fy, cx, cy = pinhole.intrinsics
    scaled = replace(pinhole, intrinsics=(fx * scale, fy * scale, cx, cy), skew=pinhole.skew * scale)
    obstacles = pinhole.obstacles
    asymmetric = [key for key in ASYMMETRIC if _coefficients(fields, key).any()]
    if asymmetric:
        obstacles += (f"{', '.join(asymmetric)} (asymmetric terms)",)
        return not_exactly(obstacles, None, pinhole.size, (HALF_PIXEL,))
    if len(k) > 4:
        obstacles += (f"{len(k) + 1} symmetric terms (opencv_fisheye has 5)",)
    if obstacles:
        return _other(name, obstacles, lambda p: brown(equidistant(p), k), scaled)
    params = np.array([*scaled.intrinsics, *(*k, 0.0, 0.0, 0.0, 0.0)[:4]])
    return as_imported(name, "opencv_fisheye", params, pinhole.size, (HALF_PIXEL,))


def _other(name: str, obstacles: tuple[str, ...], plane: Callable[[Points], Floats], pinhole: _Pinhole) -> Imported:
    return other_camera(name, obstacles, plane, pinhole.intrinsics, pinhole.size, (HALF_PIXEL,), skew=pinhole.skew)


def _coefficients(fields: Fields, name: str) -> Floats:
    """A list; empty where there is none."""
    return np.zeros(0) if fields.first(name) is None or fields.raw(name) == "null" else fields.numbers(name)
