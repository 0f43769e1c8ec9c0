"""aniposelib's, anipose's and freemocap's ``calibration.toml``: OpenCV's numbers, one table a camera.

Source: aniposelib, ``cameras.py``.
"""

import re
from collections.abc import Mapping
from pathlib import Path

from opencsp_calib.errors import FileFormatError
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.caliscope import toml_camera
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.other_camera import each_camera
from opencsp_calib_formats.reading import FileFormat, naming
from opencsp_calib_formats.safe_text import head, parse_toml, read_text

__all__ = ["Aniposelib"]

TABLE = re.compile(r"^[ \t]*\[cam_[\w-]+\]", re.MULTILINE)
NAME = re.compile(r"^[ \t]*name[ \t]*=", re.MULTILINE)


class Aniposelib(FileFormat):
    """Reads all cameras, by their name."""

    name = "aniposelib"
    title = "aniposelib, anipose, freemocap (TOML)"
    extensions = (".toml",)
    models = ("opencv4", "opencv5", "opencv8", "opencv12", "opencv14", "opencv_fisheye")
    fitted = ("skew",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        return TABLE.search(text) is not None and NAME.search(text) is not None

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            content = Fields(parse_toml(read_text(path)))
            tables = [(key, content.fields(key)) for key in content if isinstance(content.raw(key), dict)]
            cameras = [(table.text("name", key), table) for key, table in tables if table.first("matrix")]
            if not cameras:
                raise FileFormatError("none of its cameras has a matrix")
            return each_camera(cameras, toml_camera)
