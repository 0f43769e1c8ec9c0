"""mrcal's lens models: which are ours, and the formulas of the others.

With P = (X, Y, Z), r = sqrt(X² + Y²), d = |P|:

- STEREOGRAPHIC: ``x = 2 X / (d + Z)``, likewise y.
- LONLAT: ``x = atan2(X, Z)``, ``y = asin(Y / d)``.  LATLON: ``x = asin(X / d)``, ``y = atan2(Y, Z)``.
- CAHVOR: with the axis ``O = (sin a cos b, sin b, cos a cos b)``, ``w = P·O`` and ``t = |P|²/w² - 1``, the point is
  moved to ``P + (R0 + R1 t + R2 t²) (P - w O)`` and projected as by a pinhole. Where a = b = 0, that is OpenCV's radial
  model.
- CAHVORE: the same with the entrance pupil moving along the axis (E0, E1, E2) and a linearity: see `_cahvore`.

Source: mrcal documentation, "Lens models"; D. B. Gennery, "Generalized camera calibration including fish-eye lenses",
IJCV 2006.
"""

import re
from collections.abc import Callable

import numpy as np

from opencsp_calib import Problem
from opencsp_calib.arrays import Floats, Points
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import as_imported, not_exactly
from opencsp_calib.interfaces import Imported
from opencsp_calib_formats.lens import on_plane
from opencsp_calib_formats.other_camera import other_camera

__all__ = ["imported"]

COEFFICIENTS = {"PINHOLE": 0, "OPENCV4": 4, "OPENCV5": 5, "OPENCV8": 8, "OPENCV12": 12}
COEFFICIENTS |= {"STEREOGRAPHIC": 0, "LONLAT": 0, "LATLON": 0, "CAHVOR": 5, "CAHVORE": 8}
OURS = {"PINHOLE": "pinhole", "OPENCV4": "opencv4", "OPENCV5": "opencv5", "OPENCV8": "opencv8", "OPENCV12": "opencv12"}

MOVING_PUPIL = Problem(
    "not-central",
    "the entrance pupil of this CAHVORE moves with the angle: projected as for points at distance 1, as mrcal",
)


def imported(name: str, lensmodel: str, intrinsics: Floats, image_size: tuple[int, int]) -> Imported:
    """The import of an mrcal lens model.

    Parameters
    ----------
    name : str
    lensmodel : str
        As ``LENSMODEL_OPENCV8``; the older ``DISTORTION_OPENCV8`` too.
    intrinsics : (n,)
        fx, fy, cx, cy, then what the model has.
    image_size : (int, int)

    Raises
    ------
    FileFormatError
        If there is no such model, or it has another number of parameters.
    """
    match = re.fullmatch(r"(?:LENSMODEL|DISTORTION)_(\w+?)(_(\w+=).*)?", lensmodel)
    model = match[1] if match else lensmodel
    model = "PINHOLE" if model == "NONE" else model
    if model.startswith("SPLINED"):
        obstacle = "the splined lens model (mrcal-convert-lensmodel can fit OPENCV8 to it)"
        return not_exactly((obstacle,), None, image_size)
    if model not in COEFFICIENTS:
        raise FileFormatError(f"mrcal has no lens model {lensmodel[:60]!r}")
    if len(intrinsics) != 4 + COEFFICIENTS[model]:
        raise FileFormatError(f"{model} has {len(intrinsics)} intrinsics, expected {4 + COEFFICIENTS[model]}")
    if model in OURS:
        return as_imported(name, OURS[model], intrinsics, image_size)
    if model == "CAHVOR" and not intrinsics[4:6].any():
        return as_imported(name, "opencv4", _opencv_of_cahvor(intrinsics), image_size)
    core = (float(intrinsics[0]), float(intrinsics[1]), float(intrinsics[2]), float(intrinsics[3]))
    plane = _plane(model, intrinsics[4:], _linearity(lensmodel) if model == "CAHVORE" else 0.0)
    notes = (MOVING_PUPIL,) if model == "CAHVORE" and intrinsics[9:].any() else ()
    return other_camera(name, _obstacles(model, intrinsics), plane, core, image_size, notes)


def _opencv_of_cahvor(intrinsics: Floats) -> Floats:
    """The parameters of `opencv4` that equal a CAHVOR whose axis is straight ahead."""
    fx, fy, cx, cy, _, _, r0, r1, r2 = intrinsics
    if not 1.0 + r0 > 0:
        raise FileFormatError(f"R0 = {r0:g} is no CAHVOR camera")
    return np.array([fx * (1.0 + r0), fy * (1.0 + r0), cx, cy, r1 / (1.0 + r0), r2 / (1.0 + r0), 0.0, 0.0])


def _linearity(lensmodel: str) -> float:
    match = re.fullmatch(r".*_linearity=([-+.\deE]+)", lensmodel)
    try:
        linearity = float(match[1]) if match else np.nan
    except ValueError:
        linearity = np.nan
    if not np.isfinite(linearity):
        raise FileFormatError(f"{lensmodel[:60]!r} has no linearity")
    return linearity


def _obstacles(model: str, intrinsics: Floats) -> tuple[str, ...]:
    if model == "CAHVOR":
        alpha, beta = intrinsics[4:6]
        return (f"alpha = {alpha:g}, beta = {beta:g} (CAHVOR's axis O is not the optical axis)",)
    return (f"the projection {model}",)


def _plane(model: str, coefficients: Floats, linearity: float) -> Callable[[Points], Floats]:
    if model == "CAHVOR":
        return lambda points: on_plane(_cahvor(points, coefficients))
    if model == "CAHVORE":
        return lambda points: _cahvore(points, coefficients, linearity)
    return {"STEREOGRAPHIC": _stereographic, "LONLAT": _lonlat, "LATLON": _latlon}[model]


def _stereographic(points: Points) -> Floats:
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = 2.0 / (np.linalg.norm(points, axis=1) + points[:, 2])
        return np.asarray(points[:, :2] * np.where(np.isfinite(scale), scale, np.nan)[:, None], dtype=np.float64)


def _lonlat(points: Points) -> Floats:
    x, y, z = points.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.column_stack([np.arctan2(x, z), np.arcsin(y / np.linalg.norm(points, axis=1))])


def _latlon(points: Points) -> Floats:
    x, y, z = points.T
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.column_stack([np.arcsin(x / np.linalg.norm(points, axis=1)), np.arctan2(y, z)])


def _axis(alpha: float, beta: float) -> Floats:
    return np.array([np.sin(alpha) * np.cos(beta), np.sin(beta), np.cos(alpha) * np.cos(beta)])


def _cahvor(points: Points, coefficients: Floats) -> Points:
    """Points moved so that a pinhole shows them as CAHVOR does; NaN where they are not before both axes."""
    axis = _axis(coefficients[0], coefficients[1])
    along = points @ axis
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        along = np.where((along > 0) & (points[:, 2] > 0), along, np.nan)
        across = points - along[:, None] * axis
        tangent2 = (across**2).sum(axis=1) / along**2
        factor = np.polynomial.Polynomial(coefficients[2:])(tangent2)
        return np.asarray(points + factor[:, None] * across, dtype=np.float64)


def _cahvore(points: Points, coefficients: Floats, linearity: float) -> Floats:
    """Plane coordinates by CAHVORE.

    With w along the axis and l across, the angle theta of the ray at the moved entrance pupil solves
    ``w sin(theta) - l cos(theta) = (theta - sin(theta)) E(theta)``, ``E = E0 + E1 theta² + E2 theta⁴``. Then, with L
    the linearity, ``chi = tan(L theta)/L`` (sin for negative L, theta itself for 0), and the point is moved to
    ``(l/chi) axis + (1 + R0 + R1 chi² + R2 chi⁴) across``. Points are taken at distance 1, as mrcal 2.2 takes them.
    """
    points = points / np.linalg.norm(points, axis=1, keepdims=True)
    axis = _axis(coefficients[0], coefficients[1])
    radial, entrance = (np.polynomial.Polynomial(c) for c in (coefficients[2:5], coefficients[5:8]))
    along = points @ axis
    across = points - along[:, None] * axis
    length = np.linalg.norm(across, axis=1)
    with np.errstate(all="ignore"):
        theta = _pupil_angle(along, length, entrance)
        bent = linearity * theta
        chi = theta if abs(linearity) < 1e-15 else (np.tan(bent) if linearity > 0 else np.sin(bent)) / linearity
        moved = (length / chi)[:, None] * axis + (1.0 + radial(chi * chi))[:, None] * across
        moved = np.where((theta > 1e-8)[:, None], moved, points)
        moved[(np.abs(bent) > np.pi / 2) | ~np.isfinite(theta)] = np.nan
    return on_plane(moved)


def _pupil_angle(along: Floats, length: Floats, entrance: np.polynomial.Polynomial) -> Floats:
    """The angle theta of `_cahvore`, by Newton's method; NaN where it does not converge."""
    slope = entrance.deriv()  # both in theta²
    theta = np.arctan2(length, along)
    step = np.zeros_like(theta)
    for _ in range(100):
        sine, cosine, square = np.sin(theta), np.cos(theta), theta * theta
        pupil, pupil_slope = entrance(square), 2.0 * theta * slope(square)
        error = along * sine - length * cosine - (theta - sine) * pupil
        by_theta = along * cosine + length * sine - (1.0 - cosine) * pupil - (theta - sine) * pupil_slope
        step = error / by_theta
        theta = theta - step
        if not (np.abs(step) > 1e-14).any():
            break
    return np.where((np.abs(step) < 1e-8) & (theta >= 0), theta, np.nan)
