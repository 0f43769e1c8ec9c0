"""VisualSFM's ``.nvm``: focal length and one radial term of each photograph, which corrects what was measured.

With (x', y') measured from the image's centre and divided by the focal length::

    x = x' (1 + r (x'² + y'²)),  y likewise

Source: VisualSFM documentation, "NVM file format"; where the centre is, it does not say.
"""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.fields import number
from opencsp_calib_formats.lens import INVERSE, inverse_brown, on_plane
from opencsp_calib_formats.other_camera import Intrinsics, Size, each_camera, needing_size, other_camera
from opencsp_calib_formats.reading import FileFormat, naming, unverified
from opencsp_calib_formats.safe_text import MAX_BYTES, head

__all__ = ["Nvm"]

NUMBERS = {"NVM_V3": 10, "NVM_V3_R9T": 15}
"""How many numbers follow a photograph's name: f, q, c, r, 0; or f, R, t, r, 0."""

CENTRE = unverified(
    "VisualSFM does not say where the image's centre is: (w - 1)/2 is taken; cx and cy may be 0.5 px too small"
)


class Nvm(FileFormat):
    """Reads one camera a photograph, by its name."""

    name = "nvm"
    title = "VisualSFM (.nvm)"
    extensions = (".nvm",)
    models = ("pinhole",)
    fitted = ("r",)

    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""
        return head(path, 64).startswith("NVM_V3")

    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""
        with naming(path):
            lines = [line for line in head(path, MAX_BYTES).split("\n") if line.strip()]
            kind, *fixed = lines[0].split() if lines else [""]
            if kind not in NUMBERS:
                raise FileFormatError(f"starts with {kind[:40]!r}, not NVM_V3")
            count = number(lines[1] if len(lines) > 1 else None, "the number of photographs")
            if not 0 < count <= len(lines) - 2:
                raise FileFormatError(f"is said to hold {count:g} photographs, but ends before")
            calibration = _fixed(fixed)
            found = (_photograph(line, NUMBERS[kind]) for line in lines[2 : 2 + int(count)])
            return each_camera(found, lambda name, terms: _imported(name, *terms, calibration))


def _photograph(line: str, count: int) -> tuple[str, tuple[float, float]]:
    """Name; focal length and radial term."""
    words = re.split(r"\s+", line.strip())
    if len(words) < count + 1:
        raise FileFormatError(f"expected a name and {count} numbers: {line[:60]!r}")
    name, numbers = " ".join(words[:-count]), words[-count:]
    return name, (number(numbers[0], f"{name}: focal length"), number(numbers[-2], f"{name}: radial distortion"))


def _fixed(words: list[str]) -> Intrinsics | None:
    """fx, fy, cx, cy of a header ``FixedK fx cx fy cy``."""
    if not words or words[0] not in ("FixedK", "FixedCalibration"):
        return None
    if len(words) < 5:
        raise FileFormatError("FixedK is not followed by fx cx fy cy")
    fx, cx, fy, cy = (number(word, "FixedK") for word in words[1:5])
    return fx, fy, cx, cy


def _imported(name: str, f: float, r: float, fixed: Intrinsics | None) -> Imported:
    if fixed is not None:
        return _of_intrinsics(name, fixed, r, None)

    def of_size(size: Size) -> Imported:
        return _of_intrinsics(name, (f, f, (size[0] - 1) / 2, (size[1] - 1) / 2), r, size)

    return needing_size(None, of_size)


def _of_intrinsics(name: str, intrinsics: Intrinsics, r: float, size: Size | None) -> Imported:
    if r == 0:
        return as_imported(name, "pinhole", np.array(intrinsics), size, (CENTRE,))
    obstacle = f"r = {r:g} ({INVERSE})"
    return other_camera(name, (obstacle,), lambda p: inverse_brown(on_plane(p), (r,)), intrinsics, size, (CENTRE,))
