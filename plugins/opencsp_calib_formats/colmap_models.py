"""COLMAP's camera models: their parameters, which are ours, and the formulas of the others.

With x, y on the plane at unit distance, or theta X/r, theta Y/r for the fisheye models, and r² = x² + y² there:

- FOV, DIVISION, EUCM: see `lens`.
- THIN_PRISM_FISHEYE: OpenCV's radial (k1 to k4, up to r⁸), tangential and first-order prism terms, on theta.
- RAD_TAN_THIN_PRISM_FISHEYE (Project Aria): ``(a, b) = (x, y) (1 + k0 r² + ... + k5 r¹²)``, then with ``s = a² + b²``
  and ``t = 2 (a p0 + b p1)``: ``u = a + t a + s p0 + s0 s + s1 s²``, ``v = b + t b + s p1 + s2 s + s3 s²``.

Source: COLMAP, sensor/models.h and documentation "Camera Models"; Project Aria documentation, "Fisheye624".
"""

from collections.abc import Callable, Sequence

import numpy as np

from opencsp_calib.arrays import Floats, Points
from opencsp_calib.counted import counted
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.lens import brown, division, equidistant, eucm, fov, on_plane
from opencsp_calib_formats.other_camera import other_camera

__all__ = ["MODEL_OF_ID", "PARAMETERS", "imported"]

TWO, ONE = "fx fy cx cy", "f cx cy"
PARAMETERS = {
    model: names.split()
    for model, names in {
        "SIMPLE_PINHOLE": ONE,
        "PINHOLE": TWO,
        "SIMPLE_RADIAL": f"{ONE} k1",
        "RADIAL": f"{ONE} k1 k2",
        "OPENCV": f"{TWO} k1 k2 p1 p2",
        "OPENCV_FISHEYE": f"{TWO} k1 k2 k3 k4",
        "FULL_OPENCV": f"{TWO} k1 k2 p1 p2 k3 k4 k5 k6",
        "FOV": f"{TWO} omega",
        "SIMPLE_RADIAL_FISHEYE": f"{ONE} k1",
        "RADIAL_FISHEYE": f"{ONE} k1 k2",
        "THIN_PRISM_FISHEYE": f"{TWO} k1 k2 p1 p2 k3 k4 sx1 sy1",
        "RAD_TAN_THIN_PRISM_FISHEYE": f"{TWO} k0 k1 k2 k3 k4 k5 p0 p1 s0 s1 s2 s3",
        "SIMPLE_DIVISION": f"{ONE} k",
        "DIVISION": f"{TWO} k",
        "SIMPLE_FISHEYE": ONE,
        "FISHEYE": TWO,
        "EUCM": f"{TWO} alpha beta",
        "EQUIRECTANGULAR": "w h",
    }.items()
}
MODEL_OF_ID = dict(enumerate(PARAMETERS))
OURS = {
    "SIMPLE_PINHOLE": ("pinhole", 0),
    "PINHOLE": ("pinhole", 0),
    "SIMPLE_RADIAL": ("opencv4", 4),
    "RADIAL": ("opencv4", 4),
    "OPENCV": ("opencv4", 4),
    "FULL_OPENCV": ("opencv8", 8),
    "OPENCV_FISHEYE": ("opencv_fisheye", 4),
    "SIMPLE_RADIAL_FISHEYE": ("opencv_fisheye", 4),
    "RADIAL_FISHEYE": ("opencv_fisheye", 4),
    "SIMPLE_FISHEYE": ("opencv_fisheye", 4),
    "FISHEYE": ("opencv_fisheye", 4),
}
"""Our model, and its number of coefficients: COLMAP's are the first of them, in the same order."""

IN_THE_WAY = {
    "FOV": ("omega", "pinhole", ""),
    "SIMPLE_DIVISION": ("k", "pinhole", ""),
    "DIVISION": ("k", "pinhole", ""),
    "EUCM": ("alpha", "pinhole", ""),
    "THIN_PRISM_FISHEYE": ("p1 p2 sx1 sy1", "opencv_fisheye", "k1 k2 k3 k4"),
    "RAD_TAN_THIN_PRISM_FISHEYE": ("k4 k5 p0 p1 s0 s1 s2 s3", "opencv_fisheye", "k0 k1 k2 k3"),
}
"""Which parameters of the other models are in the way, and where these are all zero, our model and its coefficients."""


def imported(name: str, model: str, params: Sequence[float], image_size: tuple[int, int]) -> Imported:
    """The import of a COLMAP camera.

    Parameters
    ----------
    name : str
    model : str
        COLMAP's name for it.
    params : sequence of float
        COLMAP's; the centre of the upper-left pixel is (0.5, 0.5).
    image_size : (int, int)

    Raises
    ------
    FileFormatError
        If COLMAP has no such model, or it has another number of parameters.
    """
    if model not in PARAMETERS:
        raise FileFormatError(f"COLMAP has no camera model {model[:40]!r}")
    names = PARAMETERS[model]
    if len(params) != len(names):
        raise FileFormatError(f"a {model} camera has {counted(len(params), 'parameter')}, expected {' '.join(names)}")
    if model == "EQUIRECTANGULAR":
        return not_exactly(("the projection EQUIRECTANGULAR (the whole sphere)",), None, image_size)
    centre = names.index("cx")
    fx, fy = params[0], params[centre - 1]
    intrinsics = (fx, fy, params[centre] - 0.5, params[centre + 1] - 0.5)
    extra = tuple(params[centre + 2 :])
    if model in OURS:
        ours, count = OURS[model]
        coefficients = np.concatenate([extra, np.zeros(count - len(extra))])
        return as_imported(name, ours, np.concatenate([intrinsics, coefficients]), image_size)
    _check_domain(model, extra)
    values = dict(zip(names[centre + 2 :], extra, strict=True))
    in_the_way, ours, left = IN_THE_WAY[model]
    obstacles = tuple(f"{key} = {values[key]:g} ({model})" for key in in_the_way.split() if values[key])
    if not obstacles:
        coefficients = np.array([values[key] for key in left.split()])
        return as_imported(name, ours, np.concatenate([intrinsics, coefficients]), image_size)
    return other_camera(name, obstacles, _plane(model, extra), intrinsics, image_size)


def _check_domain(model: str, extra: Sequence[float]) -> None:
    if model == "EUCM" and not (0 <= extra[0] <= 1 and extra[1] > 0):
        raise FileFormatError(f"alpha = {extra[0]:g}, beta = {extra[1]:g} is no EUCM camera")
    if model == "FOV" and not abs(extra[0]) < np.pi:
        raise FileFormatError(f"omega = {extra[0]:g} is no FOV camera")


def _plane(model: str, extra: Sequence[float]) -> Callable[[Points], Floats]:
    """The distorted coordinates of points, before focal length and principal point."""
    if model == "FOV":
        return lambda points: fov(on_plane(points), extra[0])
    if model in ("SIMPLE_DIVISION", "DIVISION"):
        return lambda points: division(on_plane(points), extra[0])
    if model == "EUCM":
        return lambda points: eucm(points, extra[0], extra[1])
    if model == "THIN_PRISM_FISHEYE":
        k1, k2, p1, p2, k3, k4, sx1, sy1 = extra
        return lambda points: brown(equidistant(points), (k1, k2, k3, k4), (p1, p2), (sx1, 0.0, sy1, 0.0))
    return lambda points: _aria(equidistant(points), extra)


def _aria(plane: Floats, extra: Sequence[float]) -> Floats:
    """The distortion of RAD_TAN_THIN_PRISM_FISHEYE."""
    bent = brown(plane, extra[:6])
    p0, p1, s0, s1, s2, s3 = extra[6:]
    square = (bent**2).sum(axis=1)
    twice = 2.0 * (bent @ np.array([p0, p1]))
    shift = np.column_stack([square * (p0 + s0 + s1 * square), square * (p1 + s2 + s3 * square)])
    return np.asarray(bent * (1.0 + twice[:, None]) + shift, dtype=np.float64)
