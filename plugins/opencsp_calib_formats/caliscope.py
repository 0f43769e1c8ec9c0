"""Caliscope's (and pyxy3d's) ``camera_array.toml`` and older ``config.toml``: OpenCV's numbers, one table a camera.

``rotation_count`` turns the picture on the screen and is nothing of the camera's. Source: caliscope,
``cameras/camera_array.py``.
"""

import re
from collections.abc import Mapping
from pathlib import Path

from opencsp_calib.errors import FileFormatError
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.opencv_camera import opencv_camera
from opencsp_calib_formats.other_camera import each_camera
from opencsp_calib_formats.reading import FileFormat, naming
from opencsp_calib_formats.safe_text import head, parse_toml, read_text

__all__ = ["Caliscope", "toml_camera"]

NOW = re.compile(r'^[ \t]*\[cameras\.("?)[\w-]+\1\]', re.MULTILINE)
BEFORE = re.compile(r"^[ \t]*\[cam_\d+\]", re.MULTILINE)
OWN = re.compile(r"^[ \t]*(port|cam_id|grid_count|rotation_count)[ \t]*=", re.MULTILINE)
OF_OTHERS = re.compile(r"^[ \t]*name[ \t]*=", re.MULTILINE)


class Caliscope(FileFormat):
    """Reads all calibrated cameras, by their number; those without a matrix are left out."""

    name = "caliscope"
    title = "Caliscope (TOML)"
    extensions = (".toml",)
    models = ("opencv4", "opencv5", "opencv8", "opencv12", "opencv14", "opencv_fisheye")
    fitted = ("skew",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        own = OWN.search(text) is not None
        return own and (
            NOW.search(text) is not None or (BEFORE.search(text) is not None and not OF_OTHERS.search(text))
        )

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            content = Fields(parse_toml(read_text(path)))
            tables = content.fields("cameras") if "cameras" in content else content
            names = {key.removeprefix("cam_"): key for key in tables if "cameras" in content or key.startswith("cam_")}
            cameras = [(name, tables.fields(key)) for name, key in names.items()]
            calibrated = [(name, table) for name, table in cameras if table.first("matrix")]
            if not calibrated:
                raise FileFormatError("none of its cameras is calibrated (no matrix)")
            return each_camera(calibrated, toml_camera)


def toml_camera(name: str, table: Fields) -> Imported:
    """The camera of a table with ``size``, ``matrix``, ``distortions`` and maybe ``fisheye``."""
    return opencv_camera(
        name,
        table.matrix("matrix", 3, 3),
        table.numbers("distortions"),
        table.size_pair("size"),
        fisheye=table.flag("fisheye"),
    )
