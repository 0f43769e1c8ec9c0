"""Does a place in an image look like a corner of a checkerboard? Told from the grey levels on a ring around it.

Around such a corner, what stands opposite is alike, and going round, dark and bright change four times. Everything else
that resembles a corner - the end of a line, a junction, the outer corner of a square, a letter - breaks one of the two.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats, Mask, Pixels

__all__ = ["Rings", "look", "sample"]

SAMPLES = 32
HALF = SAMPLES // 2
MOST_ROWS = 32_000  # OpenCV's `remap` makes no more than 32766
NARROWEST_RAD = np.radians(15)  # a square seen at less is too oblique to be measured


@dataclass(frozen=True, eq=False)
class Rings:
    """What the rings around some places show.

    Parameters
    ----------
    edges : (n, 2) rad
        Directions of the two edges, as angles from x towards y, modulo half a turn: turning from the first to the
        second goes through dark.
    contrast : (n,)
        Brightest minus darkest, 1 being the range of the image.
    unlikeness : (n,)
        How much opposite places differ, rms, as a fraction of the contrast.
    crossing : (n,) bool
        Whether there are two edges, and neither is nearly the other.
    """

    edges: Floats
    contrast: Floats
    unlikeness: Floats
    crossing: Mask


def sample(grey: NDArray[np.float32], pixels: Floats | NDArray[np.float32]) -> NDArray[np.float32]:
    """Grey levels (n, m) at (n, m, 2) pixels between the image's own; good to a 32nd of a pixel, as `remap` is."""
    import cv2

    if pixels.size == 0:  # which OpenCV refuses
        return np.zeros(pixels.shape[:-1], dtype=np.float32)
    if len(pixels) > MOST_ROWS:
        return np.concatenate([sample(grey, pixels[:MOST_ROWS]), sample(grey, pixels[MOST_ROWS:])])
    x, y = np.moveaxis(pixels.astype(np.float32, copy=False), -1, 0)
    return np.asarray(cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE))


def look(grey: NDArray[np.float32], pixels: Pixels, radii: Floats | float) -> Rings:
    """The rings around (n, 2) pixels, with radii (n,) in pixels."""
    angles = np.arange(SAMPLES) * (2 * np.pi / SAMPLES)
    circle = np.column_stack([np.cos(angles), np.sin(angles)]).astype(np.float32)
    radii = np.broadcast_to(np.asarray(radii, dtype=np.float32), len(pixels))
    ring = sample(grey, pixels.astype(np.float32)[:, None] + radii[:, None, None] * circle)
    even, odd = (ring[:, :HALF] + ring[:, HALF:]) / 2, (ring[:, :HALF] - ring[:, HALF:]) / 2
    darkest, brightest = even.min(axis=1), even.max(axis=1)
    contrast = brightest - darkest
    height = even - (darkest + brightest)[:, None] / 2
    after = np.roll(height, -1, axis=1)
    falls, rises = (height >= 0) & (after < 0), (height < 0) & (after >= 0)
    edges = np.column_stack([_place(mask, height, after) for mask in (falls, rises)])
    dark = (edges[:, 1] - edges[:, 0]) % np.pi
    crossing = (falls.sum(axis=1) == 1) & (dark > NARROWEST_RAD) & (dark < np.pi - NARROWEST_RAD)
    unlikeness = np.sqrt((odd**2).mean(axis=1)) / np.maximum(contrast, 1e-12)
    return Rings(edges, contrast.astype(np.float64), unlikeness.astype(np.float64), crossing)


def _place(change: Mask, before: NDArray[np.float32], after: NDArray[np.float32]) -> Floats:
    """(n,) rad, where the first marked change from sample to sample passes the middle grey."""
    rows, first = np.arange(len(change)), change.argmax(axis=1)
    start, end = before[rows, first], after[rows, first]
    step = np.where(start == end, 1, start - end)
    return np.asarray((first + np.clip(start / step, 0, 1)) * (np.pi / HALF) % np.pi)
