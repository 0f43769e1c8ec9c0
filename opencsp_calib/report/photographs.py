"""The photographs in a report: thumbnails with their corners and residual arrows."""

import base64
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib.arrays import Floats, Pixels
from opencsp_calib.calibration import Calibration
from opencsp_calib.counted import counted
from opencsp_calib.detection import View
from opencsp_calib.errors import CalibError
from opencsp_calib.images import ImageFile, encode_thumbnail, read_image

__all__ = ["enlargement", "photographs"]

THUMBNAIL_PX = 480
ARROW = 0.02  # of the image's width: how long the arrow of a residual as large as the rms is
TOGETHER = 64  # views, whose photographs are read at the same time as cores allow


def photographs(calibration: Calibration) -> Iterator[str]:
    """One ``figure`` element for each image looked at, in order; used or not. A few are made ahead, never all at once.

    The images are read again from where they were, if they are still there and unchanged; without them the corners
    are drawn on an empty frame.
    """
    views = calibration.observations.views
    places: Mapping[str, str] = calibration.provenance.get("images", {})
    used = [view.image for view in calibration.observations.used]
    residuals = dict(zip(used, calibration.residuals, strict=True))
    enlarged = enlargement(calibration)
    with ThreadPoolExecutor() as pool:
        for first in range(0, len(views), TOGETHER):
            some = views[first : first + TOGETHER]
            thumbnails = pool.map(lambda view: _thumbnail(view, places.get(view.image)), some)
            for view, thumbnail in zip(some, thumbnails, strict=True):
                yield _figure(view, thumbnail, calibration, residuals.get(view.image), enlarged)


def enlargement(calibration: Calibration) -> float:
    """How many times as long as they are residuals are drawn over a photograph."""
    return ARROW * calibration.camera.image_size[0] / max(calibration.rms_px, 1e-9)


def _thumbnail(view: View, place: str | None) -> str:
    """A data address; empty where the photograph is gone, or is no longer the same."""
    if place is None or not view.sha256 or not Path(place).is_file():
        return ""
    try:
        image = read_image(ImageFile(view.image, Path(place)))
    except CalibError:
        return ""
    if image.sha256 != view.sha256:
        return ""
    return "data:image/jpeg;base64," + base64.b64encode(encode_thumbnail(image.pixels, THUMBNAIL_PX)).decode()


def _figure(view: View, thumbnail: str, calibration: Calibration, residuals: Floats | None, enlarged: float) -> str:
    width, height = calibration.camera.image_size
    stroke = width / THUMBNAIL_PX
    picture = f'<image href="{thumbnail}" x="-0.5" y="-0.5" width="{width}" height="{height}"/>' if thumbnail else ""
    corners = _dots(view.detection.pixels, 3 * stroke)
    arrows = "" if residuals is None else _arrows(view.detection.pixels, residuals * enlarged, stroke)
    rejected = _dots(
        np.array([corner.pixel for corner in view.detection.rejected]).reshape(-1, 2), 4 * stroke, "rejected"
    )
    problems = "; ".join(escape(problem.message) for problem in view.problems)
    rms = "" if residuals is None else f", rms {np.sqrt((residuals**2).sum(axis=1).mean()):.3f} px"
    return (
        '<figure class="view">'
        f'<svg viewBox="-0.5 -0.5 {width} {height}" role="img" aria-label="{escape(view.image, quote=True)}">'
        f'<rect class="empty" x="-0.5" y="-0.5" width="{width}" height="{height}"/>'
        f"{picture}{corners}{rejected}{arrows}</svg>"
        f"<figcaption><b>{escape(view.image)}</b>: {view.status}, {counted(len(view.detection), 'corner')}{rms}"
        f"{'<br>' + problems if problems else ''}</figcaption></figure>"
    )


def _dots(pixels: Pixels, size: float, kind: str = "corners") -> str:
    if not len(pixels):
        return ""
    path = "".join(f"M{x:.1f} {y:.1f}h0" for x, y in pixels)
    return f'<path class="{kind}" d="{path}" stroke-width="{size:.1f}"/>'


def _arrows(pixels: Pixels, shifts: Any, width: float) -> str:
    finite = np.isfinite(shifts).all(axis=1)
    path = "".join(
        f"M{x:.1f} {y:.1f}l{dx:.1f} {dy:.1f}" for (x, y), (dx, dy) in zip(pixels[finite], shifts[finite], strict=True)
    )
    return f'<path class="residuals" d="{path}" stroke-width="{width:.1f}"/>' if path else ""
