"""A calibration in numbers, for programs (JSON) and for people (lines of text)."""

import math
from collections.abc import Iterable, Mapping
from typing import Any

from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Observations, Problem, View
from opencsp_calib.judgement import judge
from opencsp_calib.quality import ViewQuality, view_qualities

__all__ = [
    "PIXEL_PITCH",
    "calibration_as_json",
    "camera_as_json",
    "observations_as_json",
    "parameter_lines",
    "problems_as_json",
    "view_as_json",
]

PIXEL_PITCH = "pixel_pitch_um"
"""The key in a camera's record that tells the size of its pixels in micrometres."""


def camera_as_json(camera: Camera, sigma: Iterable[float] | None = None) -> dict[str, Any]:
    """The ``camera`` object of the command line's JSON; what is not known is null."""
    names = camera.lens.parameter_names
    sigmas = [math.nan] * len(names) if sigma is None else list(sigma)
    return {
        "name": camera.name,
        "model": camera.model,
        "image_size": list(camera.image_size),
        "params": dict(zip(names, camera.params.tolist(), strict=True)),
        "sigma": {name: _number(value) for name, value in zip(names, sigmas, strict=True)},
    }


def calibration_as_json(calibration: Calibration, seconds: Mapping[str, float], output: str | None) -> dict[str, Any]:
    """What ``calibrate --json`` and ``solve --json`` print."""
    aspect = calibration.options.pixel_aspect
    qualities = {quality.image: quality for quality in view_qualities(calibration)}
    return {
        "camera": camera_as_json(calibration.camera, calibration.sigma),
        "solver": calibration.solver,
        "rms_px": calibration.rms_px,
        "rejected_corners": calibration.rejected_corners,
        "board_shape": calibration.options.board_shape,
        "pixel_aspect": "free" if aspect is None else "square" if aspect == 1.0 else aspect,
        "views": [view_as_json(view, qualities.get(view.image)) for view in calibration.observations.views],
        "warnings": problems_as_json(judge(calibration)),
        "seconds": {key: round(value, 3) for key, value in seconds.items()},
        "output": output,
    }


def observations_as_json(
    observations: Observations, seconds: Mapping[str, float], output: str | None
) -> dict[str, Any]:
    """What ``detect --json`` prints."""
    return {
        "board": observations.board.spec,
        "image_size": list(observations.image_size),
        "views": [view_as_json(view) for view in observations.views],
        "seconds": {key: round(value, 3) for key, value in seconds.items()},
        "output": output,
    }


def problems_as_json(problems: Iterable[Problem]) -> list[dict[str, str]]:
    """Codes and messages."""
    return [{"code": problem.code, "message": problem.message} for problem in problems]


def parameter_lines(
    camera: Camera, sigma: Iterable[float] | None, record: Mapping[str, str]
) -> list[tuple[str, str, str]]:
    """Names, values and sigmas as people read them; in mm too where the record knows the size of the pixels."""
    names = camera.lens.parameter_names
    sigmas = [math.nan] * len(names) if sigma is None else list(sigma)
    lines = []
    for name, value, one in zip(names, camera.params, sigmas, strict=True):
        in_pixels = name in ("fx", "fy", "cx", "cy")
        known_to = 1 - math.floor(math.log10(one)) if math.isfinite(one) and one > 0 else 0  # two digits of the sigma
        digits, unit = (max(3, known_to), " px") if in_pixels else (max(6, known_to), "")
        known = f"{one:.{digits}f}{unit}" if math.isfinite(one) else ""
        lines.append((name, f"{value:.{digits}f}{unit}", known))
    return lines + _in_millimetres(camera, record)


def _in_millimetres(camera: Camera, record: Mapping[str, str]) -> list[tuple[str, str, str]]:
    """To be held against the lens's label; the principal point from the middle of the sensor."""
    pitch_mm = _pixel_pitch_mm(record)
    if pitch_mm is None:
        return []
    fx, fy, cx, cy = camera.params[:4]
    middle_x, middle_y = ((side - 1) / 2 for side in camera.image_size)
    values = {
        "focal length x": fx * pitch_mm,
        "focal length y": fy * pitch_mm,
        "principal point x from the middle": (cx - middle_x) * pitch_mm,
        "principal point y from the middle": (cy - middle_y) * pitch_mm,
    }
    return [(name, f"{value:.4f} mm", "") for name, value in values.items()]


def _pixel_pitch_mm(record: Mapping[str, str]) -> float | None:
    """None where it is not known; a record may come from anybody's file, or be a note that somebody typed."""
    try:
        pitch_mm = float(record.get(PIXEL_PITCH, "")) * 1e-3
    except ValueError:
        return None
    return pitch_mm if math.isfinite(pitch_mm) and pitch_mm > 0 else None


def view_as_json(view: View, quality: ViewQuality | None = None) -> dict[str, Any]:
    """One of the ``views`` of the command line's JSON; what is known only once it is calibrated is null."""
    widths = view.detection.edge_width_px
    median = math.nan if widths is None or not len(widths) else float(sorted(widths)[len(widths) // 2])
    return {
        "image": view.image,
        "status": view.status,
        "corners": len(view.detection),
        "rms_px": _number(quality.rms_px) if quality else None,
        "tilt_deg": _number(quality.tilt_deg) if quality else None,
        "edge_width_px": _number(median),
        "problems": problems_as_json(view.problems),
    }


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
