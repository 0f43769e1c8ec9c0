"""OpenCV FileStorage (YAML, XML, JSON), and home-made files that keep an OpenCV camera under one of its usual names.

Nothing is converted: these are OpenCV's own conventions, and they are ours. Which names are usual is in `opencv_keys`.

Traps: ``intrinsics.yml`` of the stereo sample has no image size; 4 coefficients are k1 k2 p1 p2 or those of the
fisheye model, which only the newer tutorial's ``fisheye_model`` tells apart; numpy's shape (height, width) is found as
``camera_resolution``. Source: OpenCV samples calibration.cpp, stereo_calib.cpp and the camera calibration tutorial.
"""

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element
from xml.sax.saxutils import escape

from opencsp_calib import Camera, InputError
from opencsp_calib.arrays import Floats
from opencsp_calib.errors import FileFormatError
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields, matrix, numbers
from opencsp_calib_formats.opencv_camera import carried, either_model, opencv_camera
from opencsp_calib_formats.opencv_keys import fisheye_of, image_size_of, is_image_size, named_pairs
from opencsp_calib_formats.reading import TextFormat, comments, decimal, naming, printable, xml_comments
from opencsp_calib_formats.safe_text import head, parse_json, parse_xml, read_bytes, read_text, set_once
from opencsp_calib_formats.safe_yaml import parse_yaml

__all__ = ["OpenCVFileStorage", "is_ros"]

HINT = re.compile(r"opencv|mtx|matrix|intrinsic|(?<![A-Za-z])[KM]\d?(?![A-Za-z])", re.IGNORECASE)
MAX_BYTES = 8 * 2**20
MAX_DEPTH = 4
MAX_CAMERAS = 1000
EMPTY: Mapping[str, Any] = {}


class OpenCVFileStorage(TextFormat):
    """Reads and writes one camera, or the two of a stereo pair."""

    name = "opencv"
    title = "OpenCV FileStorage (YAML, XML, JSON)"
    extensions = (".yml", ".yaml", ".xml", ".json")
    models = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv12", "opencv14", "opencv_fisheye")
    fitted = ("skew",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`: a matrix and coefficients, and none of another program's marks."""
        if not HINT.search(head(path)):
            return False
        try:
            return any(pair[1] for _, fields in _groups(_parsed(path)) for pair in named_pairs(fields.values).values())
        except FileFormatError:
            return False

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            cameras: dict[str, Imported] = {}
            root = _parsed(path)
            for group, fields in _groups(root):
                cameras |= _cameras(group, fields, path.stem)
            if not cameras:
                raise FileFormatError("no camera matrix with distortion coefficients under a name we know")
            return cameras

    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """See `TextFormat.text`; two cameras become M1 D1 M2 D2, as OpenCV's stereo sample has them."""
        entries = _entries(tuple(cameras.values()), path)
        writer = {".xml": _as_xml, ".json": _as_json}.get(path.suffix.lower(), _as_yaml)
        return writer(entries, notes)


def is_ros(values: Mapping[str, Any]) -> bool:
    """Whether a mapping is a ROS camera_info: the same names without OpenCV's ``dt``, or those of a message."""
    camera_matrix = values.get("camera_matrix")
    if isinstance(camera_matrix, Mapping):
        return "data" in camera_matrix and "dt" not in camera_matrix and "image_width" in values
    message = {"height", "width", "distortion_model"} <= values.keys()
    return message and ({"D", "K", "P"} <= values.keys() or {"d", "k", "p"} <= values.keys())


def _parsed(path: Path) -> Any:
    text = read_text(path, MAX_BYTES)
    start = text.lstrip()[:1]
    if start == "<":
        root = parse_xml(read_bytes(path, MAX_BYTES))
        if root.tag != "opencv_storage":
            raise FileFormatError(f"the XML root is {root.tag}, not opencv_storage")
        return _of_element(root)
    if start and start in "{[":
        return parse_json(text)
    documents = parse_yaml(text)
    if len(documents) != 1 or is_ros(documents[0] if isinstance(documents[0], Mapping) else {}):
        raise FileFormatError("not one OpenCV document")
    return documents[0]


def _of_element(element: Element) -> Any:
    """A FileStorage node of XML, as of YAML: a text, a list of ``_``, or a dictionary."""
    children = list(element)
    if not children:
        text = (element.text or "").strip()
        return text[1:-1] if len(text) > 1 and text[0] == text[-1] == '"' else text
    if all(child.tag == "_" for child in children):
        return [_of_element(child) for child in children]
    values: dict[str, Any] = {}
    for child in children:
        set_once(values, child.tag, _of_element(child))
    return values


def _groups(value: Any, name: str = "", around: Mapping[str, Any] = EMPTY) -> Iterator[tuple[str, Fields]]:
    """The mappings that may hold cameras, by name: the file's own, or those within it, which take over its size."""
    if name.count(".") >= MAX_DEPTH:
        return
    if isinstance(value, list):
        if len(value) > MAX_CAMERAS or not all(isinstance(item, Mapping) for item in value):
            return
        value = {str(index): item for index, item in enumerate(value)}
    if not isinstance(value, Mapping) or "camera_poses" in value:  # multical's
        return
    pairs = named_pairs(value).values()
    if any(distortion for _, distortion in pairs) or (name and pairs):
        yield name, Fields({**around, **value}, name)
        return
    shared = {**around, **{key: item for key, item in value.items() if not isinstance(item, Mapping | list)}}
    shared |= {key: value[key] for key in value if is_image_size(key)}
    for key, item in value.items():
        yield from _groups(item, f"{name}.{key}" if name else str(key), shared)


def _cameras(group: str, fields: Fields, stem: str) -> dict[str, Imported]:
    pairs = named_pairs(fields.values)
    cameras: dict[str, Imported] = {}
    for side, (matrix_key, distortion_key) in sorted(pairs.items()):
        if distortion_key is None:
            raise FileFormatError(f"{fields.path(matrix_key)} has no distortion coefficients under a name we know")
        camera_matrix = matrix(fields.raw(matrix_key), fields.path(matrix_key), 3, 3)
        coefficients = numbers(fields.raw(distortion_key), fields.path(distortion_key))
        size, notes = image_size_of(fields, side, camera_matrix[:2, 2])
        fisheye = fisheye_of(fields, side)
        own = _own_name(fields, side)
        key = ".".join(part for part in (group, side) if part) or own
        name = own or " ".join(part for part in (stem, group, side) if part)
        if len(coefficients) == 4 and fisheye is None:
            why = f"{fields.path(distortion_key)} has 4 numbers and the file does not say of which model"
            cameras |= either_model(key, name, camera_matrix, coefficients, size, why)
        else:
            imported = opencv_camera(name, camera_matrix, coefficients, size, fisheye=bool(fisheye), notes=notes)
            cameras[key or "camera"] = imported
    return cameras


def _own_name(fields: Fields, side: str) -> str:
    key = next((key for key in (f"camera_name{side}", "camera_name") if isinstance(fields.values.get(key), str)), None)
    return fields.text(key) if key is not None else ""


def _entries(cameras: tuple[Camera, ...], path: Path) -> dict[str, Any]:
    if len(cameras) not in (1, 2):
        raise InputError(f"cannot write {path}: an OpenCV file holds one camera or a stereo pair, not {len(cameras)}")
    first = cameras[0]
    fisheye = first.model == "opencv_fisheye"
    if any((c.model == "opencv_fisheye") != fisheye or c.image_size != first.image_size for c in cameras):
        raise InputError(
            f"cannot write {path}: the two cameras of a stereo pair must have one image size and kind of lens"
        )
    entries: dict[str, Any] = {"image_width": first.image_size[0], "image_height": first.image_size[1]}
    named = [("camera_name", "camera_matrix", "distortion_coefficients")]
    if len(cameras) == 2:
        named = [(f"camera_name{i}", f"M{i}", f"D{i}") for i in (1, 2)]
    entries |= {name: camera.name for camera, (name, _, _) in zip(cameras, named, strict=True)}
    entries["fisheye_model"] = int(fisheye)
    for camera, (_, matrix_key, distortion_key) in zip(cameras, named, strict=True):
        _, coefficients = carried(camera, OpenCVFileStorage.models[1:], path, OpenCVFileStorage.title)
        entries |= {matrix_key: camera.matrix, distortion_key: coefficients[None]}
    return entries


def _as_yaml(entries: dict[str, Any], notes: Mapping[str, str]) -> str:
    lines = ["%YAML:1.0", "---", *comments(notes)]
    for key, value in entries.items():
        if isinstance(value, int | str):
            shown = json.dumps(printable(value), ensure_ascii=False) if isinstance(value, str) else str(value)
            lines.append(f"{key}: {shown}")
        else:
            rows, columns, data = _parts(value)
            lines += [f"{key}: !!opencv-matrix", f"   rows: {rows}", f"   cols: {columns}", "   dt: d"]
            lines.append(f"   data: [ {', '.join(data)} ]")
    return "\n".join(lines) + "\n"


def _as_xml(entries: dict[str, Any], notes: Mapping[str, str]) -> str:
    lines = ['<?xml version="1.0"?>', "<opencv_storage>", *xml_comments(notes)]
    for key, value in entries.items():
        if isinstance(value, int | str):
            text = str(value) if isinstance(value, int) else escape(f'"{printable(value)}"', {'"': "&quot;"})
            lines.append(f"<{key}>{text}</{key}>")
        else:
            rows, columns, data = _parts(value)
            lines += [f'<{key} type_id="opencv-matrix">', f"  <rows>{rows}</rows>", f"  <cols>{columns}</cols>"]
            lines += ["  <dt>d</dt>", "  <data>", f"    {' '.join(data)}</data></{key}>"]
    return "\n".join([*lines, "</opencv_storage>", ""])


def _as_json(entries: dict[str, Any], notes: Mapping[str, str]) -> str:
    lines = []
    for key, value in {**entries, **_keys(notes)}.items():
        if isinstance(value, int | str):
            lines.append(f'    "{key}": {json.dumps(value, ensure_ascii=False)}')
        else:
            rows, columns, data = _parts(value)
            head_ = f'"type_id": "opencv-matrix", "rows": {rows}, "cols": {columns}, "dt": "d"'
            lines.append(f'    "{key}": {{ {head_}, "data": [ {", ".join(data)} ] }}')
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _keys(notes: Mapping[str, str]) -> dict[str, str]:
    """Notes under names that OpenCV's parser takes: letters, digits, hyphens and underscores."""
    return {re.sub(r"\W+", "_", subject): note for subject, note in notes.items()}


def _parts(value: Floats) -> tuple[int, int, list[str]]:
    return value.shape[0], value.shape[1], [decimal(number) for number in value.ravel()]
