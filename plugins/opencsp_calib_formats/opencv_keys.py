"""Under which names files keep an OpenCV camera matrix, its coefficients and the image size.

Names are compared in small letters without ``_``, ``-`` and spaces; a side or a number before or after the name is the
camera's: ``left_camera_matrix``, ``K1``, ``mtxR``, ``cam0_K``.
"""

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from opencsp_calib import Problem
from opencsp_calib.arrays import Floats
from opencsp_calib.errors import FileFormatError
from opencsp_calib_formats.fields import Fields, numbers, whole
from opencsp_calib_formats.reading import unverified

__all__ = ["fisheye_of", "image_size_of", "is_image_size", "named_pairs"]

MATRIX: tuple[str, ...] = (
    "cameramatrix",
    "cammatrix",
    "intrinsicmatrix",
    "cameraintrinsics",
    "intrinsics",
    "intrinsic",
    "kmatrix",
)
MATRIX += ("cameramtx", "mtx", "k", "m")
DISTORTION: tuple[str, ...] = (
    "distortioncoefficients",
    "distortioncoeffs",
    "distortioncoeff",
    "distortioncoefs",
    "distcoefficients",
)
DISTORTION += ("distcoeffs", "distcoefs", "distcoeff", "distcoef", "distortionvector", "distortions", "distortion")
DISTORTION += ("dist", "d")
SIDE = r"(left|right|(?:cam|camera)\d+)?({})(left|right|\d+|[lr])?"
MATRIX_KEY = re.compile(SIDE.format("|".join(MATRIX)))
DISTORTION_KEY = re.compile(SIDE.format("|".join(DISTORTION)))
WIDTH_HEIGHT = (
    ("imagewidth", "imageheight"),
    ("imagesizewidth", "imagesizeheight"),
    ("imagewidthpx", "imageheightpx"),
    ("imgwidth", "imgheight"),
    ("framewidth", "frameheight"),
    ("camerawidth", "cameraheight"),
    ("width", "height"),
    ("w", "h"),
)
VAGUE = ("width", "w")
SIZE = (
    "imagesize",
    "imgsize",
    "imsize",
    "framesize",
    "size",
    "imageresolution",
    "cameraresolution",
    "resolution",
    "dim",
)
SHAPE = ("imageshape", "imgshape", "frameshape", "shape")  # numpy's: height first
FLAGS = ("fisheyemodel", "fisheye", "isfisheye", "usefisheye")
MODELS = ("distortionmodel", "projectionmodel", "cameramodel", "lensmodel", "modeltype", "model", "cameratype")
FISHEYE_WORDS = ("fisheye", "opencvfisheye", "equidistant", "equi", "kannalabrandt", "kannalabrandt4", "kb4")
PERSPECTIVE_WORDS = (
    "plumbbob",
    "radtan",
    "pinhole",
    "perspective",
    "opencv",
    "standard",
    "brown",
    "rationalpolynomial",
)


def plain(key: Any) -> str:
    """A key, or a word, in small letters without separators."""
    return re.sub(r"[\s_\-]", "", str(key)).lower()


def named_pairs(values: Mapping[str, Any]) -> dict[str, tuple[str, str | None]]:
    """For each camera in a mapping, by its side or number (or ""), the keys of its matrix and its coefficients.

    The second is None where there are none under a known name.
    """
    found = {side: key for key, side in _keys(values, MATRIX_KEY, MATRIX, _is_matrix)}
    distortions = {side: key for key, side in _keys(values, DISTORTION_KEY, DISTORTION, _is_list)}
    return {side: (key, distortions.get(side)) for side, key in found.items()}


def _keys(
    values: Mapping[str, Any], pattern: re.Pattern[str], ranked: tuple[str, ...], fits: Any
) -> list[tuple[str, str]]:
    """Keys and their sides, the best known name last."""
    found = []
    for key, value in values.items():
        match = pattern.fullmatch(plain(key))
        if match and fits(value) and not (match[1] and match[3]):
            side = match[1] or match[3] or ""
            found.append((ranked.index(match[2]), str(key), {"l": "left", "r": "right"}.get(side, side)))
    return [(key, side) for _, key, side in sorted(found, reverse=True)]


def _is_matrix(value: Any) -> bool:
    if isinstance(value, Mapping):
        return "data" in value and str(value.get("rows", 3)) == str(value.get("cols", 3)) == "3"
    return isinstance(value, list) and (len(value) == 9 or (len(value) == 3 and all(map(_is_list, value))))


def _is_list(value: Any) -> bool:
    return isinstance(value, list) or (isinstance(value, Mapping) and "data" in value)


def fisheye_of(fields: Fields, side: str) -> bool | None:
    """Whether the file says that its coefficients are the fisheye model's; None if it says nothing that we know."""
    values = {plain(key): value for key, value in fields.values.items()}
    for name in FLAGS:
        for key in (name + side, name):
            if key in values:
                return Fields(values, fields.where).flag(key)
    words = [plain(values[key]) for name in MODELS for key in (name + side, name) if isinstance(values.get(key), str)]
    if any(word in FISHEYE_WORDS for word in words):
        return True
    return False if any(word in PERSPECTIVE_WORDS for word in words) else None


def image_size_of(fields: Fields, side: str, centre: Floats) -> tuple[tuple[int, int] | None, tuple[Problem, ...]]:
    """Width and height, and what is doubtful about them; None where there are none under a known name.

    Parameters
    ----------
    fields : Fields
    side : str
        The camera's, as `named_pairs` gives it.
    centre : (2,) px
        The principal point, which tells whether a pair is width and height or numpy's height and width.
    """
    values = {plain(key): value for key, value in fields.values.items()}
    keys = {plain(key): str(key) for key in fields.values}
    for width, height in WIDTH_HEIGHT:
        for end in (side, ""):
            if width + end in values and height + end in values:
                size = Fields(values, fields.where).size(width + end, height + end)
                if width in VAGUE and _off_centre(size, centre) > 1:
                    continue  # the board's, more likely
                return size, ()
    for name in SIZE + SHAPE:
        for end in (side, ""):
            if _is_pair(values.get(name + end)):
                return _pair(values[name + end], fields.path(keys[name + end]), centre, height_first=name in SHAPE)
    return None, ()


def is_image_size(key: Any) -> bool:
    """Whether a name is one for an image size, as a pair or a mapping."""
    return plain(key) in SIZE + SHAPE


def _pair(value: Any, what: str, centre: Floats, *, height_first: bool) -> tuple[tuple[int, int], tuple[Problem, ...]]:
    if isinstance(value, Mapping) and "data" not in value:
        named = {plain(key): item for key, item in value.items()}
        width, height = ("width", "height") if "width" in named else ("w", "h")
        return Fields(named, what).size(width, height), ()
    found = numbers(value, what, 2, 3)
    if len(found) == 3 and not (height_first or found[2] in (1, 3, 4)):
        raise FileFormatError(f"{what} has 3 numbers, expected width and height")
    first, second = (whole(side, what) for side in found[:2])
    size = (second, first) if height_first or len(found) == 3 else (first, second)
    if min(size) > 0 and _off_centre(size, centre) > 0.2 and _off_centre(size[::-1], centre) < 0.1:
        taken = f"{what} = {first}, {second} is taken as {'width, height' if height_first else 'height, width'}"
        why = f"only so the principal point ({centre[0]:.0f}, {centre[1]:.0f}) is near the middle"
        return size[::-1], (unverified(f"{taken}: {why}"),)
    return size, ()


def _is_pair(value: Any) -> bool:
    return isinstance(value, list | Mapping) or (isinstance(value, str) and len(value.split()) in (2, 3))


def _off_centre(size: tuple[int, ...], centre: Floats) -> float:
    """How far from the middle the principal point is, in image sizes."""
    return float(np.abs(centre / np.maximum(size, 1) - 0.5).max())
