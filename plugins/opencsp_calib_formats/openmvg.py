"""openMVG's ``sfm_data.json``: intrinsics dumped by cereal.

``disto_k1`` and ``disto_k3`` are OpenCV's k1 [k2 k3], ``disto_t2`` k1 k2 k3 and p1 p2, ``fisheye`` OpenCV's fisheye k1
to k4. The centre of the upper-left pixel is taken to be (0, 0), which is not documented. Source: openMVG,
``cameras/Camera_*_io.hpp`` and ``Camera_Pinhole_*.hpp``.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from opencsp_calib import Problem
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.calibio import class_names
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.large_json import IN_PART, read_json
from opencsp_calib_formats.other_camera import each_camera
from opencsp_calib_formats.reading import FileFormat, naming, not_a_result, unverified
from opencsp_calib_formats.safe_text import head

__all__ = ["OpenMvg"]

KINDS = {
    "pinhole": ("", 0),
    "pinhole_radial_k1": ("disto_k1", 1),
    "pinhole_radial_k3": ("disto_k3", 3),
    "pinhole_brown_t2": ("disto_t2", 5),
    "fisheye": ("fisheye", 4),
}
"""The field that holds the distortion, and how many numbers it has."""

HALF_PIXEL = unverified(
    "openMVG does not document where its pixels' origin is; if it is the image's corner, cx and cy are 0.5 px too large"
)
UNSOLVED = not_a_result("no photograph has a pose: the file that openMVG starts from, not its result")


class OpenMvg(FileFormat):
    """Reads all intrinsics, by their key."""

    name = "openmvg"
    title = "openMVG (sfm_data.json)"
    extensions = (".json",)
    models = ("pinhole", "opencv4", "opencv5", "opencv_fisheye")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        return '"sfm_data_version"' in head(path)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            values, in_part = read_json(path, "intrinsics", "extrinsics")
            content = Fields(values)
            entries = content.each("intrinsics")
            solved = in_part or bool(content.values.get("extrinsics"))  # their end may not have been read
            notes = (HALF_PIXEL, *(() if solved else (UNSOLVED,)), *((IN_PART,) if in_part else ()))
            objects = [entry.fields("value") for entry in entries]
            keys = [str(entry.raw("key"))[:40] for entry in entries]
            named = zip(keys, zip(objects, class_names(objects), strict=True), strict=True)
            return each_camera(named, lambda name, found: _imported(name, *found, notes))


def _imported(name: str, pointer: Fields, kind: str, notes: tuple[Problem, ...]) -> Imported:
    data = pointer.fields("ptr_wrapper").fields("data")
    base = data.fields("value0") if "value0" in data else data
    size = base.size("width", "height")
    if kind not in KINDS:
        return not_exactly((f"{kind or 'a camera without a type'} (no lens model of ours)",), None, size, notes)
    f = base.number("focal_length")
    if f <= 0:
        return not_exactly(("no focal length (not calibrated)",), None, size, notes)
    field, count = KINDS[kind]
    d = data.numbers(field, count) if count else np.zeros(0)
    models = {0: ("pinhole", ()), 1: ("opencv4", (*d, 0.0, 0.0, 0.0)), 4: ("opencv_fisheye", (*d,))}
    if count in (3, 5):
        models[count] = ("opencv5", (*d[:2], *(d[3:] if count == 5 else (0.0, 0.0)), *d[2:3]))
    model, coefficients = models[count]
    return as_imported(name, model, np.array([f, f, *base.numbers("principal_point", 2), *coefficients]), size, notes)
