"""Corners fitted in photographs that a camera has sharpened, compressed or interpolated."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from corner_views import SIZE, rms, view

from opencsp_calib import Image
from opencsp_calib.arrays import Floats
from opencsp_calib.corners import refine
from opencsp_calib.rendering import Exposure


def sharpened(grey: Floats, amount: float) -> Floats:
    """As cameras and phones do it: what a blur takes away is added."""
    return np.asarray(grey + amount * (grey - cv2.GaussianBlur(grey, (0, 0), 1.0)))


def compressed(grey: Floats, quality: int) -> Floats:
    pixels = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    file = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(file, cv2.IMREAD_GRAYSCALE), dtype=np.float64)


def through_colour_filters(grey: Floats) -> Floats:
    """Each pixel sees one colour, and the others are filled in from its neighbours."""
    mosaic = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return np.asarray(cv2.cvtColor(cv2.demosaicing(mosaic, cv2.COLOR_BayerBG2BGR), cv2.COLOR_BGR2GRAY), np.float64)


PROCESSED: dict[str, Callable[[Floats], Floats]] = {
    "compressed": lambda grey: compressed(grey, 75),
    "compressed much": lambda grey: compressed(grey, 30),
    "sharpened": lambda grey: sharpened(grey, 2.0),
    "sharpened and compressed": lambda grey: compressed(sharpened(grey, 1.0), 75),
    "colour": through_colour_filters,
    "colour, sharpened, compressed": lambda grey: compressed(sharpened(through_colour_filters(grey), 1.0), 85),
    "tone curve": lambda grey: 255 * (np.clip(grey, 0, 255) / 255) ** (1 / 2.2),
    "enlarged": lambda grey: cv2.resize(cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), SIZE),
}


@pytest.mark.parametrize("name", PROCESSED)
def test_photographs_that_a_camera_has_processed(name: str) -> None:
    for square_px, limit_px in ((14, 0.03), (32, 0.02)):
        seen = view(square_px, exposure=Exposure(noise=3.0))
        pixels = np.clip(np.rint(PROCESSED[name](seen.image.pixels.astype(np.float64))), 0, 255).astype(np.uint8)
        refined = refine(Image(name, pixels), seen.found(), seen.board)
        assert len(refined) == len(seen.truth), refined.reason
        assert rms(seen.errors(refined)) < limit_px
        assert seen.squared_over_stated(refined).mean() < 2.5
