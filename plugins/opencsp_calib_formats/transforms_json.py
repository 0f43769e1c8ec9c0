"""nerfstudio's and instant-ngp's ``transforms.json``: one camera for all frames, or one a frame.

``fl_x fl_y cx cy w h k1 k2 k3 k4 p1 p2``, at the top or in each frame; the centre of the upper-left pixel is (0.5,
0.5): nerfstudio takes 0.5 off before it calls OpenCV. With perspective models k4 is the coefficient of r⁸, not OpenCV's
k4. Without ``fl_x`` there is ``camera_angle_x`` (radians) or ``x_fov`` (degrees). Source: nerfstudio,
``data_conventions.md`` and ``dataloaders.py``; instant-ngp, ``nerf_loader.cu``.
"""

import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib import Camera
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib.models import OPENCV_MODELS
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.lens import brown, on_plane
from opencsp_calib_formats.opencv_camera import carried
from opencsp_calib_formats.other_camera import Intrinsics, Size, each_camera, needing_size, other_camera
from opencsp_calib_formats.reading import TextFormat, naming, only_one
from opencsp_calib_formats.safe_text import head, parse_json, read_text

__all__ = ["TransformsJson"]

FOCAL = ("fl_x", "camera_angle_x", "x_fov")
TERMS = ("fl_x", "fl_y", "cx", "cy", "w", "h", "k1", "k2", "k3", "k4", "p1", "p2", "camera_model", "is_fisheye")
ANGLES = ("camera_angle_x", "camera_angle_y", "x_fov", "y_fov")
OTHER_LENSES = ("ftheta_p0", "latlong", "equirectangular", "orthographic")
PERSPECTIVE = ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV")
FISHEYE = "OPENCV_FISHEYE"


class TransformsJson(TextFormat):
    """Reads the intrinsics of all frames; writes a file with intrinsics and no frames."""

    name = "transforms_json"
    title = "nerfstudio and instant-ngp (transforms.json)"
    extensions = (".json",)
    models = ("pinhole", "opencv4", "opencv5", "opencv_fisheye")
    fitted = ("k4",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        return text.lstrip().startswith("{") and any(f'"{name}"' in text for name in FOCAL)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`; a camera is called by the first frame that has it."""
        with naming(path):
            content = Fields(parse_json(read_text(path)))
            different = list(_cameras(content))
            if not different:
                raise FileFormatError("no fl_x, camera_angle_x or x_fov in it")
            if len(different) == 1:
                different = [("camera", different[0][1])]
            return each_camera(different, lambda name, values: _imported(name, Fields(values, name)))

    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """See `TextFormat.text`."""
        content = {**_written(only_one(cameras, path, self.title), path), **notes}
        return json.dumps(content, indent=4) + "\n"


def _cameras(content: Fields) -> Iterator[tuple[str, dict[str, Any]]]:
    """The different sets of intrinsics, by the name of the first frame that has it."""
    common = {name: content.values[name] for name in (*TERMS, *ANGLES, *OTHER_LENSES) if name in content}
    frames = content.each("frames") if content.first("frames") else []
    seen = set()
    for frame in frames or [content]:
        own = {name: frame.values[name] for name in (*common, *TERMS, *ANGLES) if name in frame}
        intrinsics = common | own
        key = json.dumps(intrinsics, sort_keys=True, default=str)
        if key not in seen and any(name in intrinsics for name in FOCAL):
            seen.add(key)
            yield str(frame.values.get("file_path", "frame"))[:200], intrinsics


def _imported(name: str, fields: Fields) -> Imported:
    size = fields.size("w", "h") if fields.first("w", "h") else None
    model = fields.text("camera_model", FISHEYE if fields.flag("is_fisheye") else "OPENCV").upper()
    if fields.flag("is_fisheye") and model in PERSPECTIVE:
        raise FileFormatError(f"{name} is {model} and is_fisheye, which contradict each other")
    other = [lens for lens in OTHER_LENSES if fields.values.get(lens) not in (None, False)]
    if other or model not in (*PERSPECTIVE, FISHEYE):
        return not_exactly((f"camera model {', '.join(other) or model} (no lens model of ours)",), None, size)
    if fields.first("fl_x") and fields.first("cx") and fields.first("cy"):
        return _of_size(name, fields, model, size)
    return needing_size(size, lambda known: _of_size(name, fields, model, known))


def _of_size(name: str, fields: Fields, model: str, size: Size | None) -> Imported:
    intrinsics = _intrinsics(fields, size or (1, 1))
    k1, k2, k3, k4 = radial = tuple(fields.number(key, 0.0) for key in ("k1", "k2", "k3", "k4"))
    if model == FISHEYE:  # nerfstudio does not look at p1 and p2
        return as_imported(name, "opencv_fisheye", np.array([*intrinsics, *radial]), size)
    p1, p2 = fields.number("p1", 0.0), fields.number("p2", 0.0)
    if k4 != 0:
        obstacle = f"k4 = {k4:g} (here a term in r^8, which opencv models do not have)"
        return other_camera(name, (obstacle,), lambda p: brown(on_plane(p), radial, (p1, p2)), intrinsics, size)
    count = 5 if fields.first("k3") else 4 if fields.first("k1", "k2", "p1", "p2") else 0
    params = np.array([*intrinsics, k1, k2, p1, p2, k3])[: 4 + count]
    return as_imported(name, OPENCV_MODELS[count], params, size)


def _intrinsics(fields: Fields, size: Size) -> Intrinsics:
    """fx, fy, cx, cy in our convention."""
    width, height = size
    fx = _focal(fields, "x", width)
    fy = fx if fields.first("fl_y", "camera_angle_y", "y_fov") is None else _focal(fields, "y", height)
    return fx, fy, fields.number("cx", width / 2) - 0.5, fields.number("cy", height / 2) - 0.5


def _focal(fields: Fields, axis: str, side: int) -> float:
    if fields.first(f"fl_{axis}"):
        return fields.number(f"fl_{axis}")
    if fields.first(f"camera_angle_{axis}"):
        angle = fields.number(f"camera_angle_{axis}")
    else:
        angle = float(np.radians(fields.number(f"{axis}_fov")))
    if not 0 < angle < np.pi:
        raise FileFormatError(f"the field of view along {axis} is {np.degrees(angle):g} degrees, not within 0 and 180")
    return float(side / 2 / np.tan(angle / 2))


def _written(camera: Camera, path: Path) -> dict[str, Any]:
    model, distortion = carried(camera, TransformsJson.models, path, TransformsJson.title)
    fisheye = model == "opencv_fisheye"
    fx, fy, cx, cy = (float(value) for value in camera.params[:4])
    width, height = camera.image_size
    names = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2", "k3")
    return {
        "camera_model": FISHEYE if fisheye else "OPENCV" if len(distortion) else "PINHOLE",
        "fl_x": fx,
        "fl_y": fy,
        "cx": cx + 0.5,
        "cy": cy + 0.5,
        "w": width,
        "h": height,
        **{key: float(value) for key, value in zip(names, distortion, strict=False)},
        "frames": [],
    }
