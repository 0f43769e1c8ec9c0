"""Basalt's calibration: a list of cameras with named parameters.

The centre of the upper-left pixel is taken to be (0, 0), as OpenCV's. Source: basalt-headers, ``camera/*.hpp``
(formulas) and ``serialization/headers_serialization.h`` (layout).
"""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from opencsp_calib.arrays import Floats, Points
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.lens import double_sphere, eucm, fov, on_plane
from opencsp_calib_formats.other_camera import each_camera, other_camera
from opencsp_calib_formats.reading import FileFormat, naming
from opencsp_calib_formats.safe_text import head, parse_json, read_text

__all__ = ["Basalt"]

EXACT = {
    "pinhole": ("pinhole", ()),
    "kb4": ("opencv_fisheye", ("k1", "k2", "k3", "k4")),
    "pinhole-radtan8": ("opencv8", ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")),
}
Formula = tuple[tuple[str, ...], Callable[..., Floats]]
OTHER: Mapping[str, Formula] = {
    "ds": (("xi", "alpha"), double_sphere),
    "eucm": (("alpha", "beta"), eucm),
    "ucm": (("alpha",), lambda points, alpha: eucm(points, alpha, 1.0)),
    "fov": (("w",), lambda points, w: fov(on_plane(points), w)),
}
WITHIN = {"xi": (-1.0, np.inf), "alpha": (0.0, 1.0), "beta": (0.0, np.inf), "w": (-np.pi, np.pi)}


class Basalt(FileFormat):
    """Reads all cameras, by their number."""

    name = "basalt"
    title = "Basalt (JSON)"
    extensions = (".json",)
    models = ("pinhole", "opencv8", "opencv_fisheye")
    fitted = ("ds", "eucm", "ucm", "fov")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        return '"value0"' in text and '"camera_type"' in text

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            content = Fields(parse_json(read_text(path))).fields("value0")
            cameras, sizes = content.each("intrinsics"), content.raw("resolution")
            if not isinstance(sizes, list) or len(sizes) != len(cameras):
                raise FileFormatError("intrinsics and resolution are not lists of one length")
            with_size = [Fields({**camera.values, "resolution": sizes[i]}) for i, camera in enumerate(cameras)]
            named = ((str(i), camera) for i, camera in enumerate(with_size))
            return each_camera(named, _imported)


def _imported(name: str, camera: Fields) -> Imported:
    size = camera.size_pair("resolution")
    kind, parameters = camera.text("camera_type"), camera.fields("intrinsics")
    if kind not in EXACT and kind not in OTHER:
        reason = "it has no principal point" if kind == "bal" else "no lens model of ours"
        return not_exactly((f"camera_type {kind} ({reason})",), None, size)
    fx, fy, cx, cy = (parameters.number(key) for key in ("fx", "fy", "cx", "cy"))
    if kind in EXACT:
        model, keys = EXACT[kind]
        return as_imported(name, model, np.array([fx, fy, cx, cy, *(parameters.number(key) for key in keys)]), size)
    keys, formula = OTHER[kind]
    values = {key: _within(parameters, key) for key in keys}
    obstacle = f"{', '.join(f'{key} = {value:g}' for key, value in values.items())} (camera_type {kind})"

    def plane(points: Points) -> Floats:
        return formula(points, **values)

    return other_camera(name, (obstacle,), plane, (fx, fy, cx, cy), size)


def _within(parameters: Fields, key: str) -> float:
    value, (low, high) = parameters.number(key), WITHIN[key]
    if not low <= value <= high or (key != "alpha" and value in (low, high)):
        raise FileFormatError(f"{parameters.path(key)} is {value:g}, it must be within {low:g} and {high:g}")
    return value
