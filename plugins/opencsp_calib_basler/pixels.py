"""Grey levels of what a camera sends."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["GreyLevels"]


class GreyLevels:
    """Turns frames of any pixel format into grey levels, as few bits as hold them.

    8 bits stay 8 bits. Mono10, 12 and 16, packed or not, become 16 bits, shifted up so that a saturated pixel has the
    highest levels whatever the format: no bit is lost, the lowest are zero. Bayer and RGB become grey by the SDK.
    """

    def __init__(self) -> None:
        from pypylon import pylon

        self._converters = {}
        for bits, kind in ((8, pylon.PixelType_Mono8), (16, pylon.PixelType_Mono16)):
            converter = pylon.ImageFormatConverter()
            converter.OutputPixelFormat = kind
            converter.OutputBitAlignment.Value = "MsbAligned"
            self._converters[bits] = converter

    def of(self, frame: Any) -> NDArray[np.uint8] | NDArray[np.uint16]:
        """(height, width) uint8 or uint16 of a frame, a copy: the SDK's own buffer is filled again."""
        from pypylon import pylon

        kind = frame.GetPixelType()
        if kind == pylon.PixelType_Mono8:
            return np.array(frame.Array, dtype=np.uint8)
        deep = pylon.BitDepth(kind) > 8
        pixels = self._converters[16 if deep else 8].Convert(frame).GetArray()
        return np.array(pixels, dtype=np.uint16) if deep else np.array(pixels, dtype=np.uint8)
