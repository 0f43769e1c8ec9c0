"""The point spread of a lens and a moving camera, on a grid finer than the pixels.

It is one of several shapes on purpose, and never the Gaussian alone: the square pixel is always part of it, a disc of
defocus and a streak of motion may be. All of them are symmetric about their middle, so that no edge moves.
"""

from functools import lru_cache

import numpy as np
from scipy.signal import convolve2d
from scipy.special import ndtr

from opencsp_calib.arrays import Floats

__all__ = ["pixel_response"]

REACH_SIGMAS = 3.7


@lru_cache(maxsize=8)
def pixel_response(gaussian_px: float, disc_px: float, motion_px: tuple[float, float], samples: int) -> Floats:
    """How much of the light at each place around a pixel ends in that pixel.

    The ideal pattern is cut into `samples` x `samples` cells a pixel. What comes out is exactly the pattern seen
    through a point spread that is a staircase with steps of that width; the Gaussian's is made narrower by what the
    steps add, so that standard deviations come out as asked for.

    Parameters
    ----------
    gaussian_px : float
        Standard deviation of the Gaussian part.
    disc_px : float
        Radius of the disc of defocus.
    motion_px : (float, float)
        How far, and in which direction, the image moved during the exposure.
    samples : int
        Cells across a pixel.

    Returns
    -------
    (samples, samples, 2 m + 1, 2 m + 1)
        Element ``[j, i, m + y, m + x]`` is the weight, in the pixel (x, y), of cell (i, j) of the pixel (0, 0); their
        sum is 1.
    """
    kernel = _gaussian(gaussian_px, samples)
    kernel = kernel[:, None] * kernel
    if disc_px > 0:
        kernel = convolve2d(kernel, _disc(disc_px * samples))
    if any(motion_px):
        kernel = convolve2d(kernel, _streak(motion_px[0] * samples, motion_px[1] * samples))
    kernel = convolve2d(kernel, np.full((samples, samples), 1.0 / samples**2))
    return _by_pixel(kernel / kernel.sum(), samples)


def _gaussian(sigma_px: float, samples: int) -> Floats:
    """Weights on an odd number of cells: the integral over each."""
    # a step as wide as a cell adds the variance 1/12 to it
    sigma = np.sqrt(max((sigma_px * samples) ** 2 - 1.0 / 12.0, 0.0))
    reach = int(np.ceil(REACH_SIGMAS * sigma))
    if reach == 0:
        return np.ones(1)
    edges = np.arange(-reach, reach + 2) - 0.5
    return np.diff(ndtr(edges / sigma))


def _disc(radius: float) -> Floats:
    """The part of each cell that the disc covers, by 16 x 16 points a cell."""
    reach = int(np.ceil(radius))
    points = (np.arange((2 * reach + 1) * 16) + 0.5) / 16.0 - (reach + 0.5)
    inside = points[:, None] ** 2 + points**2 <= radius**2
    cells = inside.reshape(2 * reach + 1, 16, 2 * reach + 1, 16).mean(axis=(1, 3))
    return np.asarray(cells if cells.any() else np.ones((1, 1)), dtype=np.float64)


def _streak(x: float, y: float) -> Floats:
    """A straight line of that extent, its points shared linearly between the four nearest cells."""
    reach = int(np.ceil(max(abs(x), abs(y)) / 2.0)) + 1
    cells = np.zeros((2 * reach + 1, 2 * reach + 1))
    along = (np.arange(1024) + 0.5) / 1024.0 - 0.5
    px, py = along * x + reach, along * y + reach
    i, j = np.floor(px).astype(np.int64), np.floor(py).astype(np.int64)
    for di in (0, 1):
        for dj in (0, 1):
            np.add.at(cells, (j + dj, i + di), np.abs(1 - di - (px - i)) * np.abs(1 - dj - (py - j)))
    return np.asarray(cells / cells.sum(), dtype=np.float64)


def _by_pixel(kernel: Floats, samples: int) -> Floats:
    """Sort the kernel's cells, whose middle is that of the seeing pixel, by the pixel and cell that is seen."""
    reach = int(np.ceil((kernel.shape[0] - samples) / 2 / samples))
    pixels = 2 * reach + 1
    padded = np.pad(kernel, (samples * pixels - kernel.shape[0]) // 2)
    seen = padded.reshape(pixels, samples, pixels, samples)
    # a cell that lies n pixels to the right of the pixel that sees it is seen by the pixel n to its left
    return np.ascontiguousarray(seen[::-1, :, ::-1].transpose(1, 3, 0, 2))
