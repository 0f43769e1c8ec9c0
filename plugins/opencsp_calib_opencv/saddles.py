"""Places where the grey levels have a saddle: each corner of a checkerboard is one, and few other things are."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats, Mask, Pixels
from opencsp_calib_opencv.rings import look

__all__ = ["Saddles", "corner_like", "saddle_pixels"]

RING_PX = 4.0
MOST_UNLIKENESS = 0.22  # opposite places differ by less even where noise is a fifth of the contrast
LEAST_CONTRAST = 0.01  # two to three grey levels of 8 bits
SMALLEST_STRENGTH = 1e-30  # of a saddle; flat places have none


@dataclass(frozen=True, eq=False)
class Saddles:
    """Places that look like a corner of a checkerboard.

    Parameters
    ----------
    pixels : (n, 2)
    edges : (n, 2) rad
        See `Rings`.
    contrast : (n,)
    """

    pixels: Pixels
    edges: Floats
    contrast: Floats

    def keeping(self, mask: Mask) -> "Saddles":
        """Only those where the mask (n,) is true."""
        return Saddles(self.pixels[mask], self.edges[mask], self.contrast[mask])


def saddle_pixels(grey: NDArray[np.float32], most: int) -> Pixels:
    """(n, 2) pixels of the most marked saddles, so many at most, to a fraction of a pixel.

    A saddle is where the determinant of the second derivatives is most negative; one Newton step from there leads to
    where the gradient vanishes (Lucchese and Mitra, 2002).
    """
    import cv2

    second, slope, one = (np.array(k, dtype=np.float32) for k in ([1, -2, 1], [-0.5, 0, 0.5], [1]))
    xx, yy = cv2.sepFilter2D(grey, -1, second, one), cv2.sepFilter2D(grey, -1, one, second)
    xy = cv2.sepFilter2D(grey, -1, slope, slope)
    strength = xy * xy
    strength -= xx * yy
    around = cv2.dilate(strength, np.ones((5, 5), np.uint8))
    peaks = cv2.compare(strength, cv2.max(around, SMALLEST_STRENGTH, around), cv2.CMP_GE)
    border = int(RING_PX) + 2
    inside = cv2.findNonZero(peaks[border:-border, border:-border])
    x, y = np.zeros((2, 0), dtype=np.int64) if inside is None else inside.reshape(-1, 2).T.astype(np.int64) + border
    if len(x) > most:
        strongest = np.argpartition(strength[y, x], -most)[-most:]
        x, y = x[strongest], y[strongest]
    gx, gy = (grey[y, x + 1] - grey[y, x - 1]) / 2, (grey[y + 1, x] - grey[y - 1, x]) / 2
    a, b, c, s = xx[y, x], xy[y, x], yy[y, x], strength[y, x]
    step = np.column_stack([c * gx - b * gy, a * gy - b * gx]) / s[:, None]
    near = (np.abs(step) < 1.5).all(axis=1)
    return np.asarray(np.column_stack([x, y])[near] + step[near], dtype=np.float64)


def corner_like(grey: NDArray[np.float32], pixels: Pixels) -> Saddles:
    """Those of the (n, 2) pixels that look like a corner of a checkerboard of squares not smaller than the ring."""
    rings = look(grey, pixels, RING_PX)
    good = rings.crossing & (rings.unlikeness < MOST_UNLIKENESS) & (rings.contrast > LEAST_CONTRAST)
    return Saddles(pixels, rings.edges, rings.contrast).keeping(good)
