"""ROS camera_info: the YAML and ini files of camera_calibration_parsers, and messages as ``rostopic echo`` prints them.

K and D are OpenCV's, in pixels of the full sensor; R and P are for rectified images and are not part of the camera. A
region of interest and binning say what is published of the full sensor: they are applied, offset first. Taking binning
for averaging gives ``c' = (c + 1/2)/b - 1/2``, where ROS's own image_geometry has ``c/b``; the note says so.

Source: ros-perception, image_common (parse_yml.cpp, parse_ini.cpp); sensor_msgs/CameraInfo;
sensor_msgs/distortion_models.h; image_geometry, pinhole_camera_model.cpp.
"""

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib import Camera, InputError, Problem
from opencsp_calib.arrays import Floats, Params
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields, matrix, numbers, whole
from opencsp_calib_formats.opencv_camera import carried, either_model, opencv_camera
from opencsp_calib_formats.opencv_filestorage import is_ros
from opencsp_calib_formats.reading import TextFormat, comments, decimal, naming, only_one, printable, unverified
from opencsp_calib_formats.safe_text import head, read_text
from opencsp_calib_formats.safe_yaml import parse_yaml

__all__ = ["RosCameraInfo", "RosIni"]

COUNTS = {"plumb_bob": (0, 4, 5), "rational_polynomial": (4, 5, 8, 12, 14), "equidistant": (4,), "fisheye": (4,)}
KIND = {"opencv5": "plumb_bob", "opencv8": "rational_polynomial", "opencv_fisheye": "equidistant"}
INI_PARTS = ("camera matrix", "distortion", "rectification", "projection")


class RosCameraInfo(TextFormat):
    """Reads and writes camera_info as YAML; reads messages."""

    name = "ros"
    title = "ROS camera_info (YAML)"
    extensions = (".yaml", ".yml")
    models = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv_fisheye")
    fitted = ("skew",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        if not re.search(r"^(camera_matrix|K|k)\s*:", text, re.MULTILINE):
            return False
        try:
            return any(isinstance(d, Mapping) and is_ros(d) for d in parse_yaml(read_text(path)))
        except FileFormatError:
            return False

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`; of many messages of one camera the last."""
        with naming(path):
            cameras: dict[str, Imported] = {}
            for document in parse_yaml(read_text(path)):
                if isinstance(document, Mapping) and is_ros(document):
                    cameras |= _of_document(Fields(document), path.stem)
            return cameras

    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """See `TextFormat.text`."""
        camera = only_one(cameras, path, self.title)
        model, coefficients = carried(camera, tuple(KIND), path, self.title)
        width, height = camera.image_size
        lines = [*comments(notes), f"image_width: {width}", f"image_height: {height}"]
        lines += [
            f"camera_name: {json.dumps(printable(camera.name), ensure_ascii=False)}",
            *_matrix("camera_matrix", camera.matrix),
        ]
        lines += [f"distortion_model: {KIND[model]}", *_matrix("distortion_coefficients", coefficients[None])]
        lines += _matrix("rectification_matrix", np.eye(3))
        lines += _matrix("projection_matrix", np.column_stack([camera.matrix, np.zeros(3)]))
        return "\n".join(lines) + "\n"


class RosIni(TextFormat):
    """Reads and writes camera_info as an ini file; it has no name for the lens model, only 5 or 8 numbers."""

    name = "ros-ini"
    title = "ROS camera_info (ini)"
    extensions = (".ini",)
    models = ("pinhole", "opencv4", "opencv5", "opencv8")
    fitted = ("skew",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        return "[image]" in text and "camera matrix" in text and "distortion" in text

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            return _of_ini(read_text(path), path.stem)

    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """See `TextFormat.text`."""
        camera = only_one(cameras, path, self.title)
        _, coefficients = carried(camera, tuple(KIND)[:2], path, self.title)
        if not re.fullmatch(r"[\w/.-]+", camera.name):
            raise InputError(
                f"cannot write {path}: the name {camera.name!r} does not fit an ini section; rename the camera"
            )
        width, height = camera.image_size
        lines = [*comments(notes), "[image]", "", "width", str(width), "", "height", str(height), ""]
        lines.append(f"[{camera.name}]")
        values = (camera.matrix, coefficients[None], np.eye(3), np.column_stack([camera.matrix, np.zeros(3)]))
        for part, value in zip(INI_PARTS, values, strict=True):
            lines += ["", part, *(" ".join(decimal(number) for number in row) for row in value)]
        return "\n".join(lines) + "\n"


def _of_document(fields: Fields, stem: str) -> dict[str, Imported]:
    if "camera_matrix" in fields:
        keys = ("image_width", "image_height", "camera_matrix", "distortion_coefficients")
        own = fields.text("camera_name", "")
    else:
        keys = ("width", "height", *(("K", "D") if "K" in fields else ("k", "d")))
        own = fields.fields("header").text("frame_id", "") if isinstance(fields.values.get("header"), Mapping) else ""
    width, height, matrix_key, distortion_key = keys
    camera_matrix = fields.matrix(matrix_key, 3, 3)
    coefficients = numbers(fields.raw(distortion_key), distortion_key) if distortion_key in fields else np.zeros(0)
    if camera_matrix[0, 0] == 0:
        raise FileFormatError("the camera is not calibrated: its focal length is 0")
    key, size = own or "camera", fields.size(width, height)
    kind = fields.text("distortion_model", "plumb_bob")
    imported = _of_kind(own or stem, kind, camera_matrix, coefficients, size)
    return {key: _as_published(imported, fields)}


def _of_kind(name: str, kind: str, camera_matrix: Floats, coefficients: Params, size: tuple[int, int]) -> Imported:
    if kind in ("", "none") and not coefficients.any():
        kind, coefficients = "plumb_bob", np.zeros(0)
    if kind not in COUNTS:
        return not_exactly((f"distortion_model {kind!r} (not one of ROS's own)",), None, size)
    if len(coefficients) not in COUNTS[kind]:
        raise FileFormatError(f"{kind} has {len(coefficients)} coefficients, expected one of {COUNTS[kind]}")
    notes: tuple[Problem, ...] = ()
    if kind == "fisheye":
        notes = (unverified("distortion_model fisheye is not one of ROS's own: taken for its equidistant"),)
    return opencv_camera(
        name, camera_matrix, coefficients, size, fisheye=kind in ("equidistant", "fisheye"), notes=notes
    )


def _as_published(imported: Imported, fields: Fields) -> Imported:
    """What is left after the region of interest and binning."""
    full = imported.image_size or (0, 0)
    x, y, width, height = _region(fields, full)
    bx, by = (max(1, fields.whole(key, 1)) for key in ("binning_x", "binning_y"))
    if (x, y, width, height, bx, by) == (0, 0, *full, 1, 1):
        return imported
    notes = imported.notes
    if (width, height) != full:
        notes += (Problem("region-of-interest", f"{width}x{height} from ({x}, {y}) of the sensor: applied"),)
    if (bx, by) != (1, 1):
        more = " and ".join(f"{(b - 1) / (2 * b):g}" for b in (bx, by))
        text = f"binning {bx}x{by} applied as averaging; by ROS's image_geometry cx and cy are {more} px larger"
        notes += (unverified(text),)
    # the region is checked and cut by a camera of ours, whatever the lens
    sensor = imported.camera or Camera("", "pinhole", np.array([1.0, 1.0, 0.0, 0.0]), full)
    camera = _binned(sensor.cropped(x, y, width, height), bx, by)
    if imported.camera is not None:
        return Imported(camera, camera.image_size, camera.project, notes=notes)
    project = imported.project
    if project is None:
        return not_exactly(imported.obstacles, None, camera.image_size, notes)
    offset, binning = np.array([x, y]), np.array([bx, by])
    return not_exactly(
        imported.obstacles,
        lambda points: (project(points) - offset + 0.5) / binning - 0.5,
        camera.image_size,
        notes,
    )


def _region(fields: Fields, full: tuple[int, int]) -> tuple[int, int, int, int]:
    """x, y, width and height of the region of interest; all of the sensor where there is none, or it is 0 wide."""
    if not isinstance(fields.values.get("roi"), Mapping):
        return (0, 0, *full)
    roi = fields.fields("roi")
    x, y, width, height = (roi.whole(key, 0) for key in ("x_offset", "y_offset", "width", "height"))
    return x, y, width or full[0] - x, height or full[1] - y


def _binned(camera: Camera, bx: int, by: int) -> Camera:
    by_x, by_y = camera.binned(bx), camera.binned(by)
    params = camera.params.copy()
    params[[0, 2]], params[[1, 3]] = by_x.params[[0, 2]], by_y.params[[1, 3]]
    return Camera(camera.name, camera.model, params, (by_x.image_size[0], by_y.image_size[1]))


def _of_ini(text: str, stem: str) -> dict[str, Imported]:
    sections: dict[str, dict[str, list[str]]] = {}
    section: dict[str, list[str]] = {}
    values: list[str] = []
    for line in (raw.split("#")[0].strip() for raw in text.splitlines()):
        if line.startswith("[") and line.endswith("]"):
            section = sections.setdefault(line[1:-1].strip(), {})
        elif re.match(r"[A-Za-z]", line):
            values = section.setdefault(line.lower(), [])
        elif line:
            values += line.split()
    cameras: dict[str, Imported] = {}
    size = sections.get("image", {})
    for key, parts in sections.items():
        if "camera matrix" in parts:
            cameras |= _of_ini_camera(key.rpartition("/")[2] or "camera", parts, size)
    return cameras


def _of_ini_camera(key: str, parts: Mapping[str, Any], size: Mapping[str, Any]) -> dict[str, Imported]:
    width, height = (whole(" ".join(size.get(side, [])), side) for side in ("width", "height"))
    camera_matrix = matrix(parts["camera matrix"], "camera matrix", 3, 3)
    coefficients = numbers(parts.get("distortion", []), "distortion", 4, 5, 8)
    if len(coefficients) == 4:
        return either_model(
            key, key, camera_matrix, coefficients, (width, height), "an ini file does not name the model"
        )
    return {key: opencv_camera(key, camera_matrix, coefficients, (width, height))}


def _matrix(key: str, value: Floats) -> list[str]:
    data = ", ".join(decimal(number) for number in value.ravel())
    return [f"{key}:", f"  rows: {value.shape[0]}", f"  cols: {value.shape[1]}", f"  data: [{data}]"]
