"""Agisoft Metashape and PhotoScan: a lens in an XML file, or all sensors of an exported chunk.

With x = X/Z, y = Y/Z (fisheye: theta X/r, theta Y/r), r² = x² + y²::

    x' = x (1 + k1 r² + k2 r⁴ + k3 r⁶ + k4 r⁸) + (p1 (r² + 2 x²) + 2 p2 x y) (1 + p3 r² + p4 r⁴)
    y' = y (...)                               + (p2 (r² + 2 y²) + 2 p1 x y) (1 + p3 r² + p4 r⁴)
    u = w/2 + cx + x' (f + b1) + y' b2,  v = h/2 + cy + y' f

p1 and p2 are OpenCV's p2 and p1; the centre of the upper-left pixel is (0.5, 0.5); what is zero is left out. Source:
Metashape manual, appendix "Camera models". PhotoScan before 1.2 wrote fx, fy, skew and the centre in pixels, and p1, p2
in OpenCV's meaning (Agisoft Lens manual).
"""

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from opencsp_calib import Camera, Problem
from opencsp_calib.arrays import Floats, Points
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib.models import OPENCV_MODELS
from opencsp_calib_formats.fields import Fields, number
from opencsp_calib_formats.lens import brown, equidistant, equisolid, on_plane
from opencsp_calib_formats.opencv_camera import carried
from opencsp_calib_formats.other_camera import each_camera, other_camera
from opencsp_calib_formats.reading import TextFormat, naming, not_a_result, only_one, unverified, xml_comments
from opencsp_calib_formats.safe_text import head, parse_xml, read_bytes

__all__ = ["Metashape"]

CENTRAL: Mapping[str, Callable[[Points], Floats]] = {
    "frame": on_plane,
    "fisheye": equidistant,
    "equidistant_fisheye": equidistant,
    "equisolid_fisheye": equisolid,
}
RADIAL, TANGENTIAL = ("k1", "k2", "k3", "k4"), ("p1", "p2", "p3", "p4")
TERMS = ("f", "fx", "fy", "cx", "cy", "b1", "b2", "skew", *RADIAL, *TANGENTIAL)


class Metashape(TextFormat):
    """Reads lenses and chunks, writes a lens."""

    name = "metashape"
    title = "Agisoft Metashape (XML)"
    extensions = (".xml",)
    models = ("pinhole", "opencv4", "opencv5", "opencv_fisheye")
    fitted = ("b2", "k4", "p3", "p4", "equisolid fisheye")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        return ("<calibration" in text and "<projection>" in text) or ("<chunk" in text and "<sensor" in text)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`; sensors without a calibration are left out."""
        with naming(path):
            root = parse_xml(read_bytes(path))
            if root.tag == "calibration":
                kind = (root.findtext("projection") or "frame").strip()
                return {"camera": _imported("camera", root, kind, _child_size(root))}
            chunks = [chunk for chunk in root.iter("chunk") if next(chunk.iter("sensor"), None) is not None]
            if root.tag not in ("document", "chunk") or not chunks:
                raise FileFormatError("no <calibration> and no <sensor> of Metashape in it")
            return _of_chunks(chunks)

    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """See `TextFormat.text`."""
        return _written(only_one(cameras, path, self.title), path, notes)


def _of_chunks(chunks: list[Element]) -> dict[str, Imported]:
    calibrated = [found for chunk in chunks for found in _calibrated(chunk)]
    if not calibrated:
        raise FileFormatError("none of its sensors has a <calibration>: align the photos first")
    named = ((found[0].get("label") or found[0].get("id") or "camera", found) for found in calibrated)
    return each_camera(named, lambda name, found: _of_sensor(name, *found))


def _calibrated(chunk: Element) -> Iterator[tuple[Element, Element]]:
    """The sensors of a chunk with their calibration, which may be that of their master; ids are a chunk's own."""
    sensors = list(chunk.iter("sensor"))
    by_id = {sensor.get("id"): sensor for sensor in sensors}
    for sensor in sensors:
        calibration = _calibration(sensor)
        if calibration is None and sensor.get("master_id") in by_id:
            calibration = _calibration(by_id[sensor.get("master_id")])
        if calibration is not None:
            yield sensor, calibration


def _calibration(sensor: Element) -> Element | None:
    """The adjusted one of a sensor, else any."""
    found = sensor.findall("calibration")
    adjusted = [calibration for calibration in found if calibration.get("class") == "adjusted"]
    return next(iter(adjusted or found), None)


def _of_sensor(name: str, sensor: Element, calibration: Element) -> Imported:
    notes: tuple[Problem, ...] = ()
    if calibration.get("class") == "initial":
        notes = (not_a_result('class="initial": what Metashape started from, not what it found; align, then export'),)
    kind = calibration.get("type") or sensor.get("type") or "frame"
    resolution = calibration.find("resolution")
    resolution = sensor.find("resolution") if resolution is None else resolution
    size = _child_size(calibration) if resolution is None else Fields(resolution.attrib, name).size("width", "height")
    return _imported(name, calibration, kind, size, notes)


def _child_size(calibration: Element) -> tuple[int, int] | None:
    if calibration.find("width") is None and calibration.find("height") is None:
        return None
    return Fields({side: calibration.findtext(side) for side in ("width", "height")}).size("width", "height")


def _imported(
    name: str, calibration: Element, kind: str, size: tuple[int, int] | None, notes: tuple[Problem, ...] = ()
) -> Imported:
    if kind not in CENTRAL:
        return not_exactly((f"a {kind} camera (no lens model of ours)",), None, size, notes)
    if size is None:
        raise FileFormatError(f"camera {name!r} has no image size, which its principal point is relative to")
    terms = _terms(calibration)
    if "fx" in terms or "fy" in terms:
        terms = _of_photoscan(terms, size)
        message = "from PhotoScan before 1.2: the order of p1 and p2 is taken to be OpenCV's, which was not verified"
        notes = (*notes, unverified(message))
    return _of_terms(name, terms, kind, size, notes)


def _terms(calibration: Element) -> dict[str, float]:
    terms: dict[str, float] = {}
    for child in calibration:
        if child.tag in TERMS:
            value = number(child.text, child.tag)
            if terms.setdefault(child.tag, value) != value:
                raise FileFormatError(f"<{child.tag}> is there twice with different values")
    return terms


def _of_photoscan(terms: dict[str, float], size: tuple[int, int]) -> dict[str, float]:
    """The same in today's parameters: F = fy, B1 = fx - fy, B2 = skew, and p1, p2 swapped."""
    fy = terms.get("fy", terms.get("fx", 0.0))
    today = {key: value for key, value in terms.items() if key in RADIAL}
    today |= {"f": fy, "b1": terms.get("fx", fy) - fy, "b2": terms.get("skew", 0.0)}
    today |= {"cx": terms.get("cx", size[0] / 2) - size[0] / 2, "cy": terms.get("cy", size[1] / 2) - size[1] / 2}
    today |= {new: terms[old] for new, old in (("p1", "p2"), ("p2", "p1")) if old in terms}
    return today


def _of_terms(
    name: str, terms: dict[str, float], kind: str, size: tuple[int, int], notes: tuple[Problem, ...]
) -> Imported:
    if "f" not in terms:
        raise FileFormatError(f"camera {name!r} has no focal length <f>")
    f, b1, b2 = (terms.get(key, 0.0) for key in ("f", "b1", "b2"))
    cx, cy = (terms.get(key, 0.0) + side / 2 - 0.5 for key, side in zip(("cx", "cy"), size, strict=True))
    radial = tuple(terms.get(key, 0.0) for key in RADIAL)
    p2, p1, p3, p4 = (terms.get(key, 0.0) for key in TANGENTIAL)  # swapped
    intrinsics = (f + b1, f, cx, cy)
    obstacles = _obstacles(terms, kind)
    if obstacles:
        plane, tangential = CENTRAL[kind], (p1, p2, p3, p4)
        return other_camera(
            name, obstacles, lambda p: brown(plane(p), radial, tangential), intrinsics, size, notes, skew=b2
        )
    if kind != "frame":
        return as_imported(name, "opencv_fisheye", np.array([*intrinsics, *radial]), size, notes)
    count = 5 if "k3" in terms else 4 if terms.keys() & {"k1", "k2", "p1", "p2"} else 0
    params = np.array([*intrinsics, *radial[:2], p1, p2, radial[2]])[: 4 + count]
    return as_imported(name, OPENCV_MODELS[count], params, size, notes)


def _obstacles(terms: dict[str, float], kind: str) -> tuple[str, ...]:
    """What is in the way of one of our models."""
    reasons = {"b2": "skew, which our models do not have"}
    if kind == "frame":
        reasons["k4"] = "a term in r^8 that opencv models do not have"
    else:
        reasons |= dict.fromkeys(("p1", "p2"), "tangential, which opencv_fisheye does not have")
    if terms.get("p1") or terms.get("p2"):
        reasons |= dict.fromkeys(("p3", "p4"), "growth of the tangential terms, which our models do not have")
    found = [f"{key} = {terms[key]:g} ({reason})" for key, reason in reasons.items() if terms.get(key)]
    if kind == "equisolid_fisheye":
        found.append("an equisolid fisheye (opencv_fisheye is equidistant)")
    return tuple(found)


def _written(camera: Camera, path: Path, notes: Mapping[str, str]) -> str:
    model, distortion = carried(camera, Metashape.models, path, Metashape.title)
    fx, fy, cx, cy = camera.params[:4]
    width, height = camera.image_size
    fisheye = model == "opencv_fisheye"
    names = RADIAL if fisheye else ("k1", "k2", "p2", "p1", "k3")  # swapped
    terms = {"f": fy, "cx": cx + 0.5 - width / 2, "cy": cy + 0.5 - height / 2, "b1": fx - fy}
    terms |= dict(zip(names, distortion, strict=False))
    lines = [f"  <{key}>{float(terms[key])!r}</{key}>" for key in TERMS if key in terms]
    return "\n".join(
        [
            '<?xml version="1.0" encoding="UTF-8"?>',
            *xml_comments(notes),
            "<calibration>",
            f"  <projection>{'fisheye' if fisheye else 'frame'}</projection>",
            f"  <width>{width}</width>",
            f"  <height>{height}</height>",
            *lines,
            "</calibration>\n",
        ]
    )
