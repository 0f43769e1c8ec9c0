"""multical's ``calibration.json``: OpenCV's numbers, with the poses of a rig.

Source: multical, ``io/export_calib.py``; the coefficients of ``standard``, ``rational``, ``thin_prism`` and ``tilted``
are OpenCV's 5, 8, 12 and 14, in a list of one list.
"""

import re
from collections.abc import Mapping
from pathlib import Path

from opencsp_calib.importing import not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.opencv_camera import opencv_camera
from opencsp_calib_formats.other_camera import each_camera
from opencsp_calib_formats.reading import FileFormat, naming
from opencsp_calib_formats.safe_text import head, parse_json, read_text

__all__ = ["Multical"]

KNOWN = ("standard", "rational", "thin_prism", "tilted")


class Multical(FileFormat):
    """Reads all cameras, by their name."""

    name = "multical"
    title = "multical (JSON)"
    extensions = (".json",)
    models = ("opencv4", "opencv5", "opencv8", "opencv12", "opencv14")
    fitted = ("skew",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        named = all(f'"{key}"' in text for key in ("image_size", "K", "dist"))
        return named and text.lstrip().startswith("{") and re.search(r'"cameras"\s*:\s*\{', text) is not None

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            cameras = Fields(parse_json(read_text(path))).fields("cameras")
            return each_camera(((name, cameras.fields(name)) for name in cameras), _imported)


def _imported(name: str, camera: Fields) -> Imported:
    size = camera.size_pair("image_size")
    model = camera.text("model", "standard")
    if model not in KNOWN:
        return not_exactly((f"model {model} (not known to us)",), None, size)
    return opencv_camera(name, camera.matrix("K", 3, 3), camera.numbers("dist"), size)
