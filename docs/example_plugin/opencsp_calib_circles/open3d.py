"""Open3D's `PinholeCameraIntrinsic`, as `open3d.io.write_pinhole_camera_intrinsic` saves it.

A JSON object with `width`, `height` and `intrinsic_matrix`, nine numbers column by column. The centre of the first
pixel is (0, 0), as here: Open3D's own camera of 640 x 480 pixels has its middle at 319.5, 239.5.
"""

import json

import numpy as np

from opencsp_calib import InputError
from opencsp_calib.atomic import replacing
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported

KEYS = {"width", "height", "intrinsic_matrix"}
MAX_BYTES = 100_000  # such a file has some 300


class Open3D:
    """Reads and writes one pinhole camera."""

    name = "open3d"
    title = "Open3D PinholeCameraIntrinsic (JSON)"
    extensions = (".json",)
    reads = True
    writes = True
    models = ("pinhole",)

    def missing(self):
        """Nothing ever is."""

    def recognises(self, path):
        """By its keys."""
        try:
            return set(_content(path)) == KEYS
        except FileFormatError:
            return False

    def read(self, path):
        """The camera, called as the file is."""
        content = _content(path)
        try:
            matrix = np.array(content["intrinsic_matrix"], dtype=np.float64).reshape(3, 3).T
            size = int(content["width"]), int(content["height"])
            if matrix[0, 1] or matrix[1, 0] or list(matrix[2]) != [0.0, 0.0, 1.0]:
                raise InputError("its intrinsic_matrix is not [fx 0 cx; 0 fy cy; 0 0 1]")
            params = [matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]]
            return {path.stem: as_imported(path.stem, "pinhole", np.array(params), size)}
        except (KeyError, TypeError, ValueError, OverflowError, InputError) as error:
            raise FileFormatError(f"{path}: no camera of Open3D's: {error}") from None

    def write(self, cameras, path):
        """One pinhole camera."""
        if len(cameras) != 1:
            raise InputError(f"cannot write {path}: {self.title} holds one camera, not {len(cameras)}")
        (camera,) = cameras.values()
        if camera.model != "pinhole":
            raise InputError(f"cannot write {path}: {self.title} has no lens distortion, {camera.model} has")
        width, height = camera.image_size
        content = {"width": width, "height": height, "intrinsic_matrix": camera.matrix.T.ravel().tolist()}
        with replacing(path) as temporary:  # never half a file
            temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def _content(path):
    """The JSON object; FileFormatError for everything else. A stranger's file may be a folder, huge, or nonsense."""
    try:
        if not path.is_file() or path.stat().st_size > MAX_BYTES:
            raise FileFormatError(f"{path} is not a small file")
        content = json.loads(path.read_bytes())
    except (OSError, ValueError, RecursionError) as error:
        raise FileFormatError(f"{path} is not JSON: {error}") from None
    if not isinstance(content, dict):
        raise FileFormatError(f"{path} is not a JSON object")
    return content
