"""BoofCV's cameras in YAML: pinhole, radial and tangential distortion, omnidirectional, Kannala-Brandt, stereo.

t1 and t2 are OpenCV's p1 and p2; Kannala-Brandt's first symmetric coefficient multiplies theta, so that
``f = fx s0, k_i = s_i / s0`` in OpenCV's fisheye model. Pixels count from the image's corner, as the end of BoofCV's
chessboard detector suggests and nothing documents. Source: BoofCV, ``CalibrationIO.java`` and
``CameraKannalaBrandt.java``.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.lens import brown, equidistant, omni, on_plane
from opencsp_calib_formats.other_camera import other_camera
from opencsp_calib_formats.reading import FileFormat, naming, unverified
from opencsp_calib_formats.safe_text import head, parse_yaml, read_text

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


def _imported(name: str, fields: Fields) -> Imported:
    kind = fields.text("model")
    pinhole = fields.fields("pinhole")
    size = pinhole.size("width", "height")
    fx, fy, cx, cy = (pinhole.number(key) for key in ("fx", "fy", "cx", "cy"))
    intrinsics, skew = (fx, fy, cx - 0.5, cy - 0.5), pinhole.number("skew", 0.0)
    obstacles = (f"skew = {skew:g} px (our models have none)",) if skew else ()
    common = (name, fields, intrinsics, skew, obstacles, size)
    if kind == "kannala_brandt":
        return _kannala_brandt(*common)
    if kind in ("pinhole", "pinhole_radial_tangential", "omnidirectional_universal"):
        return _brown(*common)
    return not_exactly((f"model {kind} (no lens model of ours)",), None, size, (HALF_PIXEL,))


Intrinsics = tuple[float, float, float, float]
Size = tuple[int, int]


def _brown(
    name: str, fields: Fields, intrinsics: Intrinsics, skew: float, obstacles: tuple[str, ...], size: Size
) -> Imported:
    terms = fields.fields("radial_tangential") if "radial_tangential" in fields else Fields({})
    radial = [float(k) for k in _coefficients(terms, "radial")]
    t1, t2 = terms.number("t1", 0.0), terms.number("t2", 0.0)
    xi = fields.number("mirror_offset", 0.0)
    if xi:
        obstacles += (f"mirror_offset = {xi:g} (the unified omnidirectional model)",)
    while len(radial) > 3 and radial[-1] == 0:
        radial.pop()
    if len(radial) > 3:
        obstacles += (f"{len(radial)} radial terms (opencv models have 3)",)
    if obstacles:
        central = (lambda p: omni(p, xi)) if xi else on_plane
        return other_camera(
            name, obstacles, lambda p: brown(central(p), radial, (t1, t2)), intrinsics, size, (HALF_PIXEL,), skew=skew
        )
    k1, k2, k3 = (*radial, 0.0, 0.0, 0.0)[:3]
    count = 5 if len(radial) == 3 else 4 if "radial_tangential" in fields else 0
    params = np.array([*intrinsics, k1, k2, t1, t2, k3])[: 4 + count]
    return as_imported(name, f"opencv{count}" if count else "pinhole", params, size, (HALF_PIXEL,))


def _kannala_brandt(
    name: str, fields: Fields, intrinsics: Intrinsics, skew: float, obstacles: tuple[str, ...], size: Size
) -> Imported:
    symmetric = _coefficients(fields, "symmetric")
    if len(symmetric) == 0 or not symmetric[0] > 0:
        raise FileFormatError("symmetric is not a list that starts with a positive number")
    fx, fy, cx, cy = intrinsics
    intrinsics = (fx * symmetric[0], fy * symmetric[0], cx, cy)
    k = [float(s) for s in symmetric[1:] / symmetric[0]]
    if any(_coefficients(fields, key).any() for key in ASYMMETRIC):
        found = " and ".join(key for key in ASYMMETRIC if _coefficients(fields, key).any())
        return not_exactly((*obstacles, f"{found} (asymmetric terms)"), None, size, (HALF_PIXEL,))
    if any(k[4:]):
        obstacles += (f"{len(symmetric)} symmetric terms (opencv_fisheye has 5)",)
    if obstacles:
        return other_camera(
            name,
            obstacles,
            lambda p: brown(equidistant(p), k),
            intrinsics,
            size,
            (HALF_PIXEL,),
            skew=skew * symmetric[0],
        )
    return as_imported(
        name, "opencv_fisheye", np.array([*intrinsics, *(*k, 0.0, 0.0, 0.0, 0.0)[:4]]), size, (HALF_PIXEL,)
    )


def _coefficients(fields: Fields, name: str) -> Floats:
    """A list; empty where there is none."""
    return np.zeros(0) if fields.first(name) is None or fields.raw(name) == "null" else fields.numbers(name)
