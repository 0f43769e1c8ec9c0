"""mrcal's .cameramodel: a Python dictionary with lens model, intrinsics, image size and where the camera stands.

mrcal's conventions are ours: the centre of the upper-left pixel is (0, 0), x right, y down. Which lens models are ours
is in `mrcal_models`. The extrinsics and the optimization inputs (a packed calibration) are not part of a camera and
are left alone.

Traps: older files say ``lens_model`` or ``distortion_model`` and ``DISTORTION_...``; mrcal before 2.5 asks for
``extrinsics``, so they are always written, as zeros.

Source: mrcal documentation, "Camera model representation"; a file without extrinsics fails in mrcal 2.2.
"""

import re
from collections.abc import Mapping
from pathlib import Path

from opencsp_calib import Camera
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import Fields
from opencsp_calib_formats.mrcal_models import imported
from opencsp_calib_formats.opencv_camera import carried
from opencsp_calib_formats.python_literal import parse_literal
from opencsp_calib_formats.reading import TextFormat, comments, decimal, naming, only_one
from opencsp_calib_formats.safe_text import head, read_text

__all__ = ["MrcalCameraModel"]

MODEL_KEYS = ("lensmodel", "lens_model", "distortion_model")


class MrcalCameraModel(TextFormat):
    """Reads and writes one camera."""

    name = "mrcal"
    title = "mrcal .cameramodel"
    extensions = (".cameramodel",)
    models = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv12")
    fitted = ("CAHVOR off axis", "CAHVORE", "STEREOGRAPHIC", "LONLAT", "LATLON")

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        text = head(path)
        return bool(
            re.search(rf"['\"]({'|'.join(MODEL_KEYS)})['\"]\s*:\s*b?['\"](LENSMODEL|DISTORTION)_", text)
            and re.search(r"['\"]intrinsics['\"]\s*:", text)
            and re.match(r"(?:\s|#[^\n]*\n)*\{", text)
        )

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            fields = Fields(parse_literal(read_text(path)))
            lensmodel = fields.text(fields.first(*MODEL_KEYS) or MODEL_KEYS[0])
            size = fields.size_pair("imagersize")
            return {"camera": imported(path.stem, lensmodel, fields.numbers("intrinsics"), size)}

    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """See `TextFormat.text`."""
        camera = only_one(cameras, path, self.title)
        model, coefficients = carried(camera, self.models, path, self.title)
        values = ", ".join(decimal(value) for value in (*camera.params[:4], *coefficients))
        comment = camera.name.encode("unicode_escape").decode("ascii")
        lines = [
            f"# {comment}",
            *comments(notes),
            "{",
            f"    'lensmodel':  'LENSMODEL_{model.upper()}',",
            f"    'intrinsics': [ {values} ],",
            "    'extrinsics': [ 0, 0, 0, 0, 0, 0 ],",
            f"    'imagersize': [ {camera.image_size[0]}, {camera.image_size[1]} ],",
            "}",
        ]
        return "\n".join(lines) + "\n"
