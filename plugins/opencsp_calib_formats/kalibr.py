"""Kalibr camchains: the cameras of a rig in YAML, as ``cam0``, ``cam1``, ... (OpenVINS writes them too).

A point is projected by the camera model (pinhole, omni, eucm or ds), then distorted on the plane (radtan, equidistant,
fov, none). radtan is OpenCV's k1 k2 p1 p2, equidistant its fisheye model, and the centre of the upper-left pixel is
(0, 0), so pinhole cameras with these are exact. Where the cameras stand (``T_cn_cnm1``) is not part of a camera.

Trap: of omni, eucm and ds the shape parameters come first in ``intrinsics``, before the focal lengths.

Source: ethz-asl/kalibr, wiki page "Yaml formats" and aslam_cameras (projections); the formulas are in `lens`.
"""

import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib import Camera, InputError
from opencsp_calib.arrays import Floats, Points
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.lens import brown, double_sphere, eucm, fov, omni, on_plane
from opencsp_calib_formats.opencv_camera import carried
from opencsp_calib_formats.other_camera import other_camera
from opencsp_calib_formats.reading import TextFormat, comments, decimal, naming, only_one
from opencsp_calib_formats.safe_text import head, read_text
from opencsp_calib_formats.safe_yaml import parse_yaml

__all__ = ["Kalibr"]

SHAPE = {"pinhole": (), "omni": ("xi",), "eucm": ("alpha", "beta"), "ds": ("xi", "alpha")}
COEFFICIENTS = {"radtan": 4, "equidistant": 4, "fov": 1, "none": 0}
PAIRS = {
    "pinhole": ("radtan", "equidistant", "fov", "none"),
    "omni": ("radtan", "none"),
    "eucm": ("none",),
    "ds": ("none",),
}


class Kalibr(TextFormat):
    """Reads all cameras of a chain; writes one, because a chain needs the transforms between its cameras."""

    name = "kalibr"
    title = "Kalibr camchain (YAML)"
    extensions = (".yaml", ".yml")
    models = ("pinhole", "opencv4", "opencv_fisheye")
    fitted = ("omni", "eucm", "ds", "fov")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        return bool(
            re.search(r"^[ \t]*\"?cam\d+\"?[ \t]*:", text, re.MULTILINE)
            and re.search(r"\bcamera_model\b", text)
            and re.search(r"\bintrinsics\b", text)
        )

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            cameras: dict[str, Imported] = {}
            for document in parse_yaml(read_text(path)):
                root = Fields(document)
                for key in (key for key in root if re.fullmatch(r"cam\d+", key)):
                    fields = root.fields(key)
                    if "intrinsics" in fields and "camera_model" in fields:
                        cameras[key] = _imported(f"{path.stem} {key}", fields)
            return cameras

    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """See `TextFormat.text`."""
        if len(cameras) > 1:
            raise InputError(
                f"cannot write {path}: a chain needs the transforms between its cameras; choose one with --camera"
            )
        camera = only_one(cameras, path, self.title)
        model, coefficients = carried(camera, self.models, path, self.title)
        kind = {"pinhole": "none", "opencv4": "radtan", "opencv_fisheye": "equidistant"}[model]
        lines = [
            *comments(notes),
            "cam0:",
            "  cam_overlaps: []",
            "  camera_model: pinhole",
            f"  distortion_coeffs: {_listed(coefficients)}",
            f"  distortion_model: {kind}",
            f"  intrinsics: {_listed(camera.params[:4])}",
            f"  resolution: [{camera.image_size[0]}, {camera.image_size[1]}]",
            "  rostopic: /cam0/image_raw",
        ]
        return "\n".join(lines) + "\n"


def _listed(values: Floats) -> str:
    return f"[{', '.join(decimal(value) for value in values)}]"


def _imported(name: str, fields: Fields) -> Imported:
    model, distortion = fields.text("camera_model"), fields.text("distortion_model", "none")
    distortion = "equidistant" if distortion == "equi" else distortion
    if distortion not in PAIRS.get(model, ()):
        raise FileFormatError(f"{fields.where} is {model} with {distortion}: Kalibr has no such camera")
    shape_names = SHAPE[model]
    intrinsics = [float(value) for value in fields.numbers("intrinsics", len(shape_names) + 4)]
    coefficients = [float(value) for value in _coefficients(fields, COEFFICIENTS[distortion])]
    size = fields.size_pair("resolution")
    shape = dict(zip(shape_names, intrinsics, strict=False))
    fx, fy, cx, cy = intrinsics[len(shape_names) :]
    if distortion == "fov" and coefficients[0] == 0:
        distortion, coefficients = "none", []
    if _is_perspective(model, shape) and distortion != "fov":
        ours = {"none": "pinhole", "radtan": "opencv4", "equidistant": "opencv_fisheye"}[distortion]
        return as_imported(name, ours, np.array([fx, fy, cx, cy, *coefficients]), size)
    _check_shape(model, shape, fields)
    if distortion == "fov" and not abs(coefficients[0]) < np.pi:
        raise FileFormatError(f"{fields.path('distortion_coeffs')}: w = {coefficients[0]:g} is no angle below pi")
    obstacles = tuple(f"{key} = {value:g} ({model} model)" for key, value in shape.items())
    if distortion == "fov":
        obstacles = (f"w = {coefficients[0]:g} (fov distortion)",)
    plane = _plane(model, shape, distortion, coefficients)
    return other_camera(name, obstacles, plane, (fx, fy, cx, cy), size)


def _coefficients(fields: Fields, count: int) -> Any:
    return fields.numbers("distortion_coeffs", count) if count else ()


def _is_perspective(model: str, shape: Mapping[str, float]) -> bool:
    """Whether a camera model is the pinhole after all."""
    if model == "eucm":
        return shape["alpha"] == 0
    return not any(shape.values())


def _check_shape(model: str, shape: Mapping[str, float], fields: Fields) -> None:
    sane = {
        "pinhole": True,
        "omni": shape.get("xi", 0) > -1,
        "eucm": 0 <= shape.get("alpha", 0) <= 1 and shape.get("beta", 1) > 0,
        "ds": 0 <= shape.get("alpha", 0) <= 1 and shape.get("xi", 0) > -1,
    }
    if not sane[model]:
        values = ", ".join(f"{key} = {value:g}" for key, value in shape.items())
        raise FileFormatError(f"{fields.path('intrinsics')}: {values} is no camera of the model {model}")


def _plane(
    model: str, shape: Mapping[str, float], distortion: str, coefficients: list[float]
) -> Callable[[Points], Floats]:
    def project(points: Points) -> Floats:
        if model == "eucm":
            return eucm(points, shape["alpha"], shape["beta"])
        if model == "ds":
            return double_sphere(points, shape["xi"], shape["alpha"])
        if model == "omni":
            plane = omni(points, shape["xi"])
            return brown(plane, coefficients[:2], coefficients[2:]) if distortion == "radtan" else plane
        return fov(on_plane(points), coefficients[0])

    return project
