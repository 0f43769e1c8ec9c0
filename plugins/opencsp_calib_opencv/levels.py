"""One photograph at several sizes: most boards are found, and quickest, in a reduced one."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Pixels
from opencsp_calib.image import Image

__all__ = ["Level", "levels"]

FIRST_LEVEL_PX = 600_000  # large enough for 1000 corners, small enough for 10 ms
LARGEST_LEVEL_PX = 4_500_000  # bounds time and memory for any photograph: a level costs 15 ms and 40 MB a megapixel
LONGEST_SIDE_PX = 30_000  # OpenCV's `remap` cannot address more than 32767
SMOOTHING_PX = 1.2  # noise of a twentieth of the contrast must not make or break a corner


@dataclass(frozen=True, eq=False)
class Level:
    """A photograph reduced by averaging blocks of pixels, then smoothed.

    Parameters
    ----------
    grey : (height, width) float32
        From 0, black, to 1, where the photograph is saturated.
    factor : int
        Side of the blocks.
    """

    grey: NDArray[np.float32]
    factor: int

    def to_image(self, pixels: Pixels) -> Pixels:
        """(..., 2) pixels of this level as pixels of the photograph."""
        return (pixels + 0.5) * self.factor - 0.5


def levels(image: Image) -> Iterator[Level]:
    """Reduced photographs, in the order in which it pays to search them: small, finer and finer, then very coarse.

    The coarse one at last is for a board that is out of focus; nothing else needs it.
    """
    area, longest = image.pixels.size, max(image.size)
    factors = [2**n for n in range(16)]
    allowed = [f for f in factors if area <= LARGEST_LEVEL_PX * f**2 and longest <= LONGEST_SIDE_PX * f]
    first = next(f for f in allowed if area <= FIRST_LEVEL_PX * f**2)
    finer = [f for f in reversed(allowed) if f <= first]
    for factor in [*finer, 2 * first]:
        if min(image.size) >= 16 * factor:
            yield reduced(image, factor)


def reduced(image: Image, factor: int) -> Level:
    """The photograph with blocks of `factor` times `factor` pixels averaged; an incomplete last block is left out."""
    import cv2

    width, height = (side // factor for side in image.size)
    whole = image.pixels[: height * factor, : width * factor]
    small = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA) if factor > 1 else whole
    grey = small.astype(np.float32) / np.float32(image.white)
    return Level(cv2.GaussianBlur(grey, (0, 0), SMOOTHING_PX), factor)
