"""OpenSfM and OpenDroneMap: cameras in ``reconstruction.json``, ``camera_models.json`` or ODM's ``cameras.json``.

Everything is divided by the larger image side, with the origin at the image's centre, which is the pixel ((w - 1)/2,
(h - 1)/2): ``fx = focal_x max(w, h)``, ``cx = c_x max(w, h) + (w - 1)/2``. Source: OpenSfM, documentation "Geometric
models"; functions ``camera_from_json`` and ``normalized_image_coordinates``. ``camera_models.json`` holds only what
OpenSfM starts from; ODM takes the "v2 " off the cameras' names and the "_prior" fields out of its result.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib import Camera, InputError, Problem
from opencsp_calib.arrays import Floats
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.large_json import IN_PART, read_json
from opencsp_calib_formats.lens import brown, equidistant
from opencsp_calib_formats.opencv_camera import carried
from opencsp_calib_formats.other_camera import Size, each_camera, needing_size, other_camera
from opencsp_calib_formats.reading import TextFormat, naming, not_a_result
from opencsp_calib_formats.safe_text import MAX_BYTES, head

__all__ = ["OpenSfM"]

EXACT = {
    "perspective": ("opencv4", ("k1", "k2")),
    "simple_radial": ("opencv4", ("k1",)),
    "radial": ("opencv4", ("k1", "k2")),
    "brown": ("opencv5", ("k1", "k2", "p1", "p2", "k3")),
    "fisheye": ("opencv_fisheye", ("k1", "k2")),
    "fisheye_opencv": ("opencv_fisheye", ("k1", "k2", "k3", "k4")),
}
"""Our lens model of a projection type, and its coefficients in our order."""

FISHEYE_62 = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
FISHEYE_624 = (*FISHEYE_62, "s0", "s1", "s2", "s3")
GUESS = "OpenSfM's camera_models.json holds what it starts from, not a result; take reconstruction.json"


class OpenSfM(TextFormat):
    """Reads all three files; writes what ODM reads with ``--cameras``."""

    name = "opensfm"
    title = "OpenSfM and OpenDroneMap (JSON)"
    extensions = (".json",)
    models = ("pinhole", "opencv4", "opencv5", "opencv_fisheye")
    fitted = ("fisheye62", "fisheye624")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        start = head(path, 64).lstrip()
        return start.startswith(("{", "[")) and '"projection_type"' in head(path, MAX_BYTES)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`; of several reconstructions, all cameras."""
        with naming(path):
            content, in_part = read_json(path, "cameras")
            found, guess = _cameras(content)
            guess = guess or path.name == "camera_models.json"
            notes = (*((not_a_result(GUESS),) if guess else ()), *((IN_PART,) if in_part else ()))
            return each_camera(found, lambda name, fields: _imported(name, fields, notes))

    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """See `TextFormat.text`; notes stand within each camera, because all that is at the top is a camera."""
        if not cameras:
            raise InputError(f"cannot write {path}: no camera")
        content = {name: {**_written(camera, path), **notes} for name, camera in cameras.items()}
        return json.dumps(content, indent=4) + "\n"


def _cameras(content: Any) -> tuple[list[tuple[str, Fields]], bool]:
    """Name and fields of each camera, and whether they are only what OpenSfM starts from."""
    if isinstance(content, list):
        reconstructions = [Fields(item, f"reconstruction {i}").fields("cameras") for i, item in enumerate(content)]
    elif isinstance(content, dict) and "cameras" in content:
        reconstructions = [Fields(content).fields("cameras")]
    else:
        reconstructions = [Fields(content)]
    found = [(name, cameras.fields(name)) for cameras in reconstructions for name in cameras]
    bare = isinstance(content, dict) and "cameras" not in content
    return found, bare and any(_guessed(name, fields) for name, fields in found)


def _guessed(name: str, fields: Fields) -> bool:
    return name.startswith("v2 ") or any(field.endswith("_prior") for field in fields)


def _imported(name: str, fields: Fields, notes: tuple[Problem, ...]) -> Imported:
    kind = fields.text("projection_type", "perspective")
    known = fields.size("width", "height") if fields.whole("width", 0) else None
    if kind not in EXACT and kind not in ("fisheye62", "fisheye624"):
        return not_exactly((f"projection_type {kind} (no lens model of ours)",), None, known, notes)
    return needing_size(known, lambda size: _of_size(name, fields, kind, size, notes))


def _of_size(name: str, fields: Fields, kind: str, size: Size, notes: tuple[Problem, ...]) -> Imported:
    intrinsics = _intrinsics(fields, size)
    if kind in EXACT:
        model, keys = EXACT[kind]
        if kind == "brown":  # as many as there are: we leave out what a lesser model does not have
            keys = keys if "k3" in fields else keys[:4]
            model = "opencv5" if "k3" in fields else "opencv4" if any(key in fields for key in keys) else "pinhole"
            keys = () if model == "pinhole" else keys
        coefficients = [fields.number(key, 0.0) for key in keys] + [0.0] * 4
        count = {"pinhole": 0, "opencv5": 5}.get(model, 4)
        return as_imported(name, model, np.array([*intrinsics, *coefficients[:count]]), size, notes)
    return _fisheye62(name, fields, intrinsics, kind, size, notes)


def _fisheye62(
    name: str, fields: Fields, intrinsics: Floats, kind: str, size: Size, notes: tuple[Problem, ...]
) -> Imported:
    keys = FISHEYE_62 if kind == "fisheye62" else FISHEYE_624
    terms = {key: fields.number(key, 0.0) for key in keys}
    radial, tangential, prism = ([terms[key] for key in keys if key.startswith(letter)] for letter in "kps")
    obstacles = tuple(
        f"{key} = {terms[key]:g} (a term that opencv_fisheye does not have)" for key in keys[4:] if terms[key]
    )
    if not obstacles:
        return as_imported(name, "opencv_fisheye", np.array([*intrinsics, *radial[:4]]), size, notes)
    fx, fy, cx, cy = (float(value) for value in intrinsics)
    return other_camera(
        name, obstacles, lambda p: brown(equidistant(p), radial, tangential, prism), (fx, fy, cx, cy), size, notes
    )


def _intrinsics(fields: Fields, size: Size) -> Floats:
    """fx, fy, cx, cy in pixels."""
    larger = max(size)
    if "focal" in fields:
        fx = fy = fields.number("focal")
    else:
        fx, fy = fields.number("focal_x"), fields.number("focal_y", fields.number("focal_x"))
    centre = [fields.number(key, 0.0) * larger + (side - 1) / 2 for key, side in zip(("c_x", "c_y"), size, strict=True)]
    return np.array([fx * larger, fy * larger, *centre])


def _written(camera: Camera, path: Path) -> dict[str, Any]:
    model, distortion = carried(camera, OpenSfM.models, path, OpenSfM.title)
    kind = "fisheye_opencv" if model == "opencv_fisheye" else "brown"
    (width, height), larger = camera.image_size, max(camera.image_size)
    fx, fy, cx, cy = (float(value) for value in camera.params[:4])
    return {
        "projection_type": kind,
        "width": width,
        "height": height,
        "focal_x": fx / larger,
        "focal_y": fy / larger,
        "c_x": (cx - (width - 1) / 2) / larger,
        "c_y": (cy - (height - 1) / 2) / larger,
        **{key: float(value) for key, value in zip(EXACT[kind][1], distortion, strict=False)},
    }
