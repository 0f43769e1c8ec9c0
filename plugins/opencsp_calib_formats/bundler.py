"""Bundler's ``bundle.out``: focal length and two radial terms of each photograph.

The camera looks along -z with y up: turned by half about x, which leaves k1 and k2 as they are, its image is ::

    u = f (1 + k1 r² + k2 r⁴) x + (w - 1)/2,  v likewise

Source: Bundler's README, "Output format"; Bundle2PMVS and RadialUndistort take (w - 1)/2 as the centre.
"""

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import number
from opencsp_calib_formats.other_camera import each_camera, needing_size
from opencsp_calib_formats.reading import FileFormat, naming, unverified
from opencsp_calib_formats.safe_text import MAX_BYTES, head

__all__ = ["Bundler"]

START = "# Bundle file"
PER_CAMERA = 15  # f k1 k2, R, t

CENTRE = unverified(
    "Bundler's programs disagree on the image's centre: (w - 1)/2 is taken; if w/2 is right, add 0.5 px to cx and cy"
)


class Bundler(FileFormat):
    """Reads one camera a photograph, by its number; those that were not registered are left out."""

    name = "bundler"
    title = "Bundler (bundle.out)"
    extensions = (".out",)
    models = ("opencv4",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        return head(path, 256).startswith(START)

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            text = head(path, MAX_BYTES)  # the cameras come first; the points behind them may be of any number
            if not text.startswith(START):
                raise FileFormatError(f"does not start with {START!r}")
            words = text.partition("\n")[2].split()
            count = number(words[0] if words else None, "the number of cameras")
            if not 0 < count <= (len(words) - 2) / PER_CAMERA:
                raise FileFormatError(f"is said to hold {count:g} cameras, but ends before")
            starts = range(2, 2 + int(count) * PER_CAMERA, PER_CAMERA)
            cameras = [(str(i), words[start : start + 3]) for i, start in enumerate(starts)]
            return each_camera((camera for camera in cameras if _registered(camera[1])), _imported)


def _registered(words: list[str]) -> bool:
    return any(number(word, "f, k1 or k2") != 0 for word in words)


def _imported(name: str, words: list[str]) -> Imported:
    f, k1, k2 = (number(word, f"camera {name}'s f, k1 or k2") for word in words)

    def of_size(size: tuple[int, int]) -> Imported:
        centre = (size[0] - 1) / 2, (size[1] - 1) / 2
        return as_imported(name, "opencv4", np.array([f, f, *centre, k1, k2, 0.0, 0.0]), size, (CENTRE,))

    return needing_size(None, of_size)
