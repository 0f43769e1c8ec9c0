"""One photograph at several sizes: most boards are found, and quickest, in a reduced one."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Pixels
from opencsp_calib.image import Image

__all__ = ["Level", "finest_level", "levels"]

FIRST_LEVEL_PX = 600_000  # large enough for 1000 corners, small enough for 10 ms
QUICK_LEVEL_PX, PX_A_CORNER = 150_000, 600  # squares are 10 px wide where the board fills a sixth of the image
QUICK_FACTOR = 4  # with more, corners are known to no more than two pixels of the photograph
LARGEST_LEVEL_PX = 4_500_000  # bounds time and memory for any photograph: a level costs 15 ms and 40 MB a megapixel
LONGEST_SIDE_PX = 30_000  # OpenCV's `remap` cannot address more than 32767
SMALLEST_SIDE_PX = 16  # less shows no board
FACTORS = tuple(2**n for n in range(16))
SMOOTHING_PX = 1.2  # noise of a twentieth of the contrast must not make or break a corner


@dataclass(frozen=True, eq=False)
class Level:
    """A photograph reduced by averaging blocks of pixels.

    Parameters
    ----------
    sharp : (height, width) float32
        From 0, black, to 1, where the photograph is saturated.
    grey : (height, width) float32
        The same, smoothed.
    factor : int
        Side of the blocks.
    """

    sharp: NDArray[np.float32]
    grey: NDArray[np.float32]
    factor: int

    def to_image(self, pixels: Pixels) -> Pixels:
        """(..., 2) pixels of this level as pixels of the photograph."""
        return (pixels + 0.5) * self.factor - 0.5

    def stretched(self, *, inverted: bool = False) -> NDArray[np.uint8]:
        """`sharp` in 8 bits, stretched to the range between the darkest and brightest hundredths."""
        step = max(1, self.sharp.size // 100_000)
        dark, bright = np.percentile(self.sharp.ravel()[::step], [1, 99])
        levels = (self.sharp - dark) * (255 / max(bright - dark, 1e-3))
        pixels = np.asarray(np.clip(levels, 0, 255), dtype=np.uint8)
        return np.invert(pixels) if inverted else pixels


def levels(image: Image, corners: int) -> Iterator[Level]:
    """Reduced photographs, in the order in which it pays to search them: small, finer and finer, then very coarse.

    The first is the smaller, the fewer corners are looked for. The coarse one at last is for a board that is out of
    focus; nothing else needs it.
    """
    allowed = _allowed(image)

    def smallest(area: int) -> int:
        return next(f for f in allowed if image.pixels.size <= area * f**2)

    quick = smallest(max(QUICK_LEVEL_PX, PX_A_CORNER * corners))
    first = min(quick, max(smallest(FIRST_LEVEL_PX), QUICK_FACTOR))
    finer = [f for f in reversed(allowed) if f <= first]
    for factor in [*finer, 2 * first]:
        if min(image.size) >= SMALLEST_SIDE_PX * factor:
            yield reduced(image, factor)


def finest_level(image: Image) -> Level | None:
    """The photograph itself, unless it is too large; None where it is too small to show anything."""
    factor = _allowed(image)[0]
    return reduced(image, factor) if min(image.size) >= SMALLEST_SIDE_PX * factor else None


def _allowed(image: Image) -> list[int]:
    """Factors that bound time and memory, finest first."""
    area, longest = image.pixels.size, max(image.size)
    return [f for f in FACTORS if area <= LARGEST_LEVEL_PX * f**2 and longest <= LONGEST_SIDE_PX * f]


def reduced(image: Image, factor: int) -> Level:
    """The photograph with blocks of `factor` times `factor` pixels averaged; an incomplete last block is left out."""
    import cv2

    width, height = (side // factor for side in image.size)
    whole = image.pixels[: height * factor, : width * factor]
    small = cv2.resize(whole, (width, height), interpolation=cv2.INTER_AREA) if factor > 1 else whole
    grey = small.astype(np.float32) / np.float32(image.white)
    return Level(grey, cv2.GaussianBlur(grey, (0, 0), SMOOTHING_PX), factor)
