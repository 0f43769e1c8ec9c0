"""Photographs as OpenCV's searches want them: 8 bits a pixel."""

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.image import Image

__all__ = ["eight_bit"]


def eight_bit(image: Image) -> NDArray[np.uint8]:
    """Grey levels (height, width), the image's own range scaled to 0..255; not to be written to."""
    if image.pixels.dtype == np.uint8:
        return np.ascontiguousarray(image.pixels, dtype=np.uint8)
    scale = 255.0 / image.white
    return np.asarray(np.minimum(np.rint(image.pixels * np.float32(scale)), 255), dtype=np.uint8)
