"""Fits corners of one photograph, in windows that follow the size of the squares around them."""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats, Mask
from opencsp_calib.corner_fit import CornerFit, Levels
from opencsp_calib.corner_kernel import DIAGNOSTICS, FAILED, RAMP_PX, fit_corners

__all__ = ["FULL", "NEAR", "SMALL", "Surroundings", "WindowSize"]

MOST_STEPS = 20
SMALLEST_HALF_WINDOW_PX = 2.5
BLUR_OF_NEXT = 2.0  # deviations: 1 leaves errors larger than stated, 3 costs noise


@dataclass(frozen=True)
class WindowSize:
    """How large a window, and how well the corner in it is to be located.

    Parameters
    ----------
    fraction : float
        Half the window, as part of a square's side,
    largest_px : float
        but at most so many pixels.
    tolerance_px : float
        The last step is shorter; what remains after it is a small part of that.
    """

    fraction: float
    largest_px: float
    tolerance_px: float


NEAR = WindowSize(0.5, 7.0, 0.03)  # to come near, from 2 px away
FULL = WindowSize(0.7, 14.0, 0.01)  # neighbours' edges stay outside
SMALL = WindowSize(0.35, 7.0, 0.01)  # where something disturbs the full one: outer squares of half a width, dirt


@dataclass(frozen=True, eq=False)
class Surroundings:
    """A photograph, and what is known about the surroundings of each corner in it.

    Parameters
    ----------
    image : (height, width) uint8 or uint16
    white : int
        Grey level at which pixels are saturated.
    lengths : (n, 2) px
        Of the squares' sides, along each edge.
    bends : (n, 2) 1/px
        Curvature of each edge.
    clear : float
        The part of a square's side, from an edge on, in which nothing but the checkerboard is printed; infinite for
        plain checkerboards.
    """

    image: Levels
    white: int
    lengths: Floats
    bends: Floats
    clear: float = np.inf

    def fit(self, start: CornerFit, size: WindowSize, where: Mask, *, examine: bool = True) -> CornerFit:
        """The fit from a start, where it is wanted and the image's border is far enough; elsewhere nothing converges.

        Not to `examine` leaves out all but where the corners are, and takes two thirds of the time.
        """
        nothing = CornerFit(start.parameters, np.full((len(where), DIAGNOSTICS), float(FAILED)))
        if not where.any():
            return nothing
        windows = self.windows(start, size)
        chosen = np.flatnonzero(where & np.isfinite(windows[:, 0]))
        parameters = start.parameters[chosen]
        found = fit_corners(
            self.image, self.white, parameters, self.bends[chosen], windows[chosen], size.tolerance_px, MOST_STEPS,
            examine=examine,
        )  # fmt: skip
        return nothing.replaced(chosen, CornerFit(parameters, found))

    def windows(self, fit: CornerFit, size: WindowSize) -> Floats:
        """(n, 4) px: half the window along both edges; how far from an edge pixels count. NaN too near to the border.

        Windows end before the blur of the next edge begins, unless that would leave too little. Near the image's border
        they shrink, so that they stay symmetric about the corner.
        """
        height, width = self.image.shape
        clear = np.maximum(self.lengths - BLUR_OF_NEXT * fit.blur_px[:, None], SMALL.fraction * self.lengths)
        halves = np.minimum(np.minimum(size.fraction * self.lengths, size.largest_px), clear)
        reach = ((halves + RAMP_PX)[:, :, None] * np.abs(fit.directions)).sum(axis=1)
        room = np.minimum(fit.pixels, np.array([width - 1, height - 1]) - fit.pixels)
        with np.errstate(divide="ignore", invalid="ignore"):  # no direction is known, or no size
            shrunk = halves * np.clip((room / reach).min(axis=1), 0, 1)[:, None]
        shrunk[~(shrunk.min(axis=1) >= np.minimum(SMALLEST_HALF_WINDOW_PX, halves.min(axis=1)))] = np.nan
        if np.isinf(self.clear):
            return np.concatenate([shrunk, np.full(shrunk.shape, np.inf)], axis=1)
        return np.concatenate([shrunk, np.maximum(self.clear * self.lengths - fit.blur_px[:, None], 1.0)], axis=1)
