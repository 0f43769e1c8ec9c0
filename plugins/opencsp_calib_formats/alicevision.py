"""AliceVision and Meshroom: the intrinsics of an ``.sfm`` file or its JSON, of all versions.

Every value is a string. The focal length was first in pixels (one number, then two), then in millimetres of the
sensor's width, with a pixel ratio that changed sides twice; the principal point was first in pixels, then relative to
(w/2, h/2). Integer coordinates are pixel centres, which is inferred from AliceVision's samplers and not documented.
Source: AliceVision, ``sfmDataIO/jsonIO.cpp`` and ``camera/Distortion*.cpp``.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from opencsp_calib import Problem
from opencsp_calib.arrays import Floats
from opencsp_calib.counted import counted
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.large_json import IN_PART, read_json
from opencsp_calib_formats.lens import fov, on_plane
from opencsp_calib_formats.other_camera import Intrinsics, Size, each_camera, other_camera
from opencsp_calib_formats.reading import FileFormat, naming, not_a_result, unverified
from opencsp_calib_formats.safe_text import MAX_BYTES, head

__all__ = ["AliceVision"]

Version = tuple[int, ...]

DISTORTION_OF_TYPE = {
    "pinhole": "none",
    "radial1": "radialk1",
    "radial3": "radialk3",
    "brown": "brown",
    "fisheye": "fisheye",
    "fisheye4": "fisheye",
    "fisheye1": "fisheye1",
}
"""The distortion of a combined type, as files before 1.2.8 have it."""

NEWEST = (1, 2, 11)  # of the versions whose rules are known
COUNTS = {"none": 0, "radialk1": 1, "radialk3": 3, "radialk3pt": 3, "brown": 5, "fisheye": 4, "fisheye1": 1}

HALF_PIXEL = unverified(
    "AliceVision does not document where its pixels' origin is; if it is the corner, cx and cy are 0.5 px too large"
)


class AliceVision(FileFormat):
    """Reads all intrinsics of a file."""

    name = "alicevision"
    title = "AliceVision and Meshroom (.sfm, JSON)"
    extensions = (".sfm", ".json")
    models = ("pinhole", "opencv4", "opencv5", "opencv_fisheye")
    fitted = ("fisheye1",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        return head(path, 64).lstrip().startswith("{") and '"intrinsicId"' in head(path, MAX_BYTES)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`; the cameras' names are their intrinsicId."""
        with naming(path):
            values, in_part = read_json(path, "version", "intrinsics")
            content = Fields(values)
            version = tuple(int(number) for number in content.numbers("version", 3))
            named = ((str(fields.raw("intrinsicId"))[:40], fields) for fields in content.each("intrinsics"))
            more = (IN_PART,) if in_part else ()
            return each_camera(named, lambda name, fields: _imported(name, fields, version, more))


def _imported(name: str, fields: Fields, version: Version, more: tuple[Problem, ...]) -> Imported:
    size = fields.size("width", "height")
    kind = fields.text("type", "pinhole")
    notes = _notes(fields, size) + more
    if version > NEWEST:
        known = ".".join(map(str, NEWEST))
        notes += (unverified(f"the file is of a newer version than {known}: read by that one's rules"),)
    distortion = fields.text("distortionType", DISTORTION_OF_TYPE.get(kind, "")) or "none"
    undistortion = fields.text("undistortionType", "none")
    obstacles = []
    if kind not in DISTORTION_OF_TYPE or distortion not in COUNTS:
        obstacles.append(f"type {kind}, distortion {distortion} (no lens model of ours)")
    if undistortion != "none" or _parameters(fields, "undistortionParams").any():
        obstacles.append(f"undistortion {undistortion} (no lens model of ours)")
    if _focal(fields, version)[1] <= 0:
        obstacles.append("no focal length (not calibrated)")
    if obstacles:
        return not_exactly(tuple(obstacles), None, size, notes)
    return _of_distortion(name, distortion, fields, _intrinsics(fields, version, size), size, notes)


def _notes(fields: Fields, size: Size) -> tuple[Problem, ...]:
    notes = [HALF_PIXEL]
    if size[1] > size[0]:
        notes.append(
            unverified(
                "the image is taller than wide, and AliceVision writes and reads its focal length by different sides; "
                f"if it was written by the taller one, fx and fy are {size[1] / size[0]:.6g} times larger"
            )
        )
    mode = fields.text("initializationMode", "calibrated")
    if mode not in ("estimated", "calibrated"):
        notes.append(not_a_result(f"initializationMode is {mode!r}, not estimated nor calibrated: may be a default"))
    elif fields.flag("locked"):
        notes.append(not_a_result("the intrinsics are locked: what was given to AliceVision, not what it found"))
    return tuple(notes)


def _parameters(fields: Fields, name: str) -> Floats:
    """The numbers of a list; none where it is the empty string, as property trees write empty lists."""
    return fields.numbers(name) if name in fields else np.zeros(0)


def _focal(fields: Fields, version: Version) -> tuple[str, float]:
    """The field that holds the focal length, and its first number."""
    name = "pxFocalLength" if version < (1, 2, 2) else "focalLength"
    return name, float(fields.numbers(name, 1, 2)[0])


def _intrinsics(fields: Fields, version: Version, size: Size) -> Intrinsics:
    """fx, fy, cx, cy in pixels, by the rules of the file's version."""
    name, focal = _focal(fields, version)
    if version < (1, 2, 2):
        fx, fy = focal, float(fields.numbers(name)[-1])
    else:
        focal *= size[0] / fields.positive("sensorWidth", 36.0)
        ratio = fields.positive("pixelRatio", 1.0)
        if version < (1, 2, 5):
            fx, fy = focal, focal / ratio
        elif version < (1, 2, 11):
            fx, fy = focal, focal * ratio
        else:
            fx, fy = focal / ratio, focal
    cx, cy = (float(value) for value in fields.numbers("principalPoint", 2))
    if version >= (1, 2, 1):
        cx, cy = cx + size[0] / 2, cy + size[1] / 2
    return fx, fy, cx, cy


def _of_distortion(
    name: str, distortion: str, fields: Fields, intrinsics: Intrinsics, size: Size, notes: tuple[Problem, ...]
) -> Imported:
    given = _parameters(fields, "distortionParams")
    if len(given) not in (0, COUNTS[distortion]):
        raise FileFormatError(
            f"{fields.path('distortionParams')} has {counted(len(given), 'number')}, {distortion} has "
            f"{COUNTS[distortion]}"
        )
    d = given if len(given) else np.zeros(COUNTS[distortion])
    if distortion == "fisheye1" and d[0] != 0:
        w = float(d[0])
        if not 0 < w < np.pi:
            raise FileFormatError(f"the field of view of {fields.where} is {w:g}, it must be within 0 and pi")
        obstacle = f"fisheye1 = {w:g} (the field-of-view model)"
        return other_camera(name, (obstacle,), lambda p: fov(on_plane(p), w), intrinsics, size, notes)
    if distortion == "radialk3pt":
        scale = 1.0 + d.sum()
        if not scale > 0:
            raise FileFormatError(
                f"{fields.path('distortionParams')} sum to {d.sum():g}: radialk3pt divides by 1 + sum"
            )
        intrinsics = (intrinsics[0] / scale, intrinsics[1] / scale, *intrinsics[2:])
    models = {
        "none": ("pinhole", ()),
        "fisheye1": ("pinhole", ()),
        "radialk1": ("opencv4", (*d, 0.0, 0.0, 0.0)),
        "radialk3": ("opencv5", (*d[:2], 0.0, 0.0, *d[2:])),
        "radialk3pt": ("opencv5", (*d[:2], 0.0, 0.0, *d[2:])),
        "brown": ("opencv5", (*d[:2], *d[3:], *d[2:3])),
        "fisheye": ("opencv_fisheye", (*d,)),
    }
    model, coefficients = models[distortion]
    return as_imported(name, model, np.array([*intrinsics, *coefficients]), size, notes)
