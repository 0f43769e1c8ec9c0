"""Grey levels between pixels."""

import numpy as np

from opencsp_calib.arrays import Floats, Pixels
from opencsp_calib.image import Image

__all__ = ["bilinear", "nearest"]


def bilinear(image: Image, pixels: Pixels) -> Floats:
    """Grey levels (...,) at (..., 2) pixels, 1 being saturated; NaN outside the image."""
    width, height = image.size
    x, y = pixels[..., 0], pixels[..., 1]
    inside = (x >= 0) & (y >= 0) & (x <= width - 1) & (y <= height - 1)
    x, y = np.where(inside, x, 0), np.where(inside, y, 0)
    left, top = np.minimum(x.astype(np.int64), width - 2), np.minimum(y.astype(np.int64), height - 2)
    u, v = x - left, y - top
    grey, first = image.pixels.ravel(), top * width + left  # one index instead of two: half the time
    upper = grey.take(first) * (1 - u) + grey.take(first + 1) * u
    lower = grey.take(first + width) * (1 - u) + grey.take(first + width + 1) * u
    return np.asarray(np.where(inside, (upper * (1 - v) + lower * v) / image.white, np.nan))


def nearest(image: Image, pixels: Pixels) -> Floats:
    """Grey levels (...,) of the pixels in which (..., 2) places lie, 1 being saturated; NaN outside the image."""
    width, height = image.size
    places = np.rint(pixels)
    x, y = places[..., 0], places[..., 1]
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    index = np.where(inside, y * width + x, 0).astype(np.int64)
    return np.asarray(np.where(inside, image.pixels.ravel().take(index) / image.white, np.nan))
