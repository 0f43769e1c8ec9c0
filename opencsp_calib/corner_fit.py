"""Fits the image of a corner around many places at once: arrays in, arrays out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Covariances, Floats, Ids, Mask, Pixels
from opencsp_calib.compiled import corner_fit

__all__ = ["CornerFit", "begin", "improve", "windows"]

MOST_STEPS = 15
FIRST_BLUR_PX = 1.5
SMALLEST_HALF_WINDOW_PX = 2.5
ROUNDING = 1 / 12  # variance of grey levels: the least noise an image can have


@dataclass(frozen=True, eq=False)
class CornerFit:
    """The parameters of the image of each corner, and how they were found; see `opencsp_calib.corner_kernel`.

    Parameters
    ----------
    parameters : (n, 9)
    diagnostics : (n, 22)
        NaN where nothing is known yet.
    """

    parameters: Floats
    diagnostics: Floats

    @property
    def pixels(self) -> Pixels:
        """(n, 2) where the corners are."""
        return self.parameters[:, :2]

    @property
    def directions(self) -> Floats:
        """(n, 2, 2) unit vectors along the two edges."""
        angles = self.parameters[:, 2:4]
        return np.stack([np.cos(angles), np.sin(angles)], axis=-1)

    @property
    def blur_px(self) -> Floats:
        """(n,) standard deviation of the Gaussian that makes edges as wide."""
        return self.parameters[:, 4]

    @property
    def amplitude(self) -> Floats:
        """(n,) half of white minus black, grey levels; its sign says which squares are white."""
        return self.parameters[:, 6]

    @property
    def converged(self) -> Mask:
        """(n,) whether there is a result."""
        return np.asarray(self.diagnostics[:, 0] == 0)

    @property
    def outside(self) -> Mask:
        """(n,) whether the window was not within the image."""
        return np.asarray(self.diagnostics[:, 0] == 1)

    @property
    def misfit(self) -> Floats:
        """(n,) what is neither noise nor alike on opposite sides, root mean square, as a fraction of the amplitude."""
        excess = np.maximum(self.variance - self.noise_variance, 0)
        return np.asarray(np.sqrt(excess) / np.maximum(np.abs(self.amplitude), 1e-9))

    @property
    def variance(self) -> Floats:
        """(n,) of grey levels about the model, without what is alike on opposite sides of the corner and harmless."""
        return np.maximum(self.diagnostics[:, 1], ROUNDING)

    @property
    def noise_variance(self) -> Floats:
        """(n,) of grey levels about the model, from differences of neighbours: what varies from pixel to pixel only."""
        return np.maximum(self.diagnostics[:, 2], ROUNDING)

    @property
    def correlation(self) -> float:
        """Of the noise of neighbouring pixels: compressed, resampled or smoothed images have such, sensors do not."""
        if not self.converged.any():
            return 0.0
        shares = 1 - self.noise_variance[self.converged] / self.variance[self.converged]
        return float(np.clip(np.median(shares), 0, 0.9))

    def covariance(self, bend_deviations: Floats) -> Covariances:
        """(n, 2, 2) px², when the bends (1/px) that were given are known with these deviations (n, 2).

        Where the noise of neighbouring pixels is correlated, so are their pulls on the corner: fully along the edge, less
        across, where the pull is a Gaussian's derivative.
        """
        xx, xy, yy = self.diagnostics[:, 3:6].T
        unit = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)
        across = np.exp(-1 / (4 * self.blur_px**2))
        variance = self.variance * (1 + 2 * self.correlation) * (1 + 2 * self.correlation * across)
        response = self.diagnostics[:, 6:10].reshape(-1, 2, 2) * bend_deviations[:, None, :]
        return np.asarray(unit * variance[:, None, None] + response @ response.transpose(0, 2, 1))

    def replaced(self, where: Ids, other: "CornerFit") -> "CornerFit":
        """The same with other fits (m) at some places (m,)."""
        parameters, diagnostics = self.parameters.copy(), self.diagnostics.copy()
        parameters[where], diagnostics[where] = other.parameters, other.diagnostics
        return CornerFit(parameters, diagnostics)

    def __getitem__(self, where: Ids) -> "CornerFit":
        return CornerFit(self.parameters[where], self.diagnostics[where])

    @property
    def quadrant_misfit(self) -> Floats:
        """(n, 4) mean residual in each quarter of the window, as a fraction of the amplitude."""
        return self.diagnostics[:, 10:14]

    @property
    def quadrant_saturation(self) -> Floats:
        """(n, 4) share of saturated pixels in each quarter of the window."""
        return self.diagnostics[:, 14:18]


def begin(image: NDArray[np.uint16], pixels: Pixels, vectors: Floats) -> CornerFit:
    """A first guess: grey levels read at a few places in each of the four squares around a corner.

    Parameters
    ----------
    image : (height, width)
    pixels : (n, 2)
    vectors : (n, 2, 2) px
        To the next corner along the two edges.
    """
    from opencsp_calib.corner_kernel import DIAGNOSTICS, PARAMETERS

    height, width = image.shape
    far = np.array([-0.4, -0.3, -0.2, 0.2, 0.3, 0.4])
    along_row, along_column = far[:, None] * vectors[:, None, 0], far[:, None] * vectors[:, None, 1]
    places = pixels[:, None, None] + along_row[:, :, None] + along_column[:, None, :]
    x, y = np.rint(places).astype(np.int64).transpose(3, 0, 1, 2)
    levels = image[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)].astype(np.float64)
    same_side = np.sign(far)[:, None] * np.sign(far)
    parameters = np.zeros((len(pixels), PARAMETERS))
    parameters[:, :2] = pixels
    parameters[:, 2:4] = np.arctan2(vectors[..., 1], vectors[..., 0])
    parameters[:, 4] = FIRST_BLUR_PX
    parameters[:, 5] = levels.mean(axis=(1, 2))
    parameters[:, 6] = -(levels * same_side).mean(axis=(1, 2))
    return CornerFit(parameters, np.full((len(pixels), DIAGNOSTICS), np.nan))


def improve(
    image: NDArray[np.uint16], white: int, start: CornerFit, bends: Floats, half_windows: Floats, tolerance_px: float
) -> CornerFit:
    """The fit, from a start.

    Parameters
    ----------
    image : (height, width)
    white : int
        Grey level at which pixels are saturated.
    start : CornerFit
    bends : (n, 2) 1/px
        Curvature of the two edges.
    half_windows : (n, 4) px
        See `windows`; NaN where no fit shall be made.
    tolerance_px : float
        The last step is shorter.
    """
    from opencsp_calib.corner_kernel import DIAGNOSTICS, WORK_SIZE

    parameters = start.parameters.copy()
    found = np.zeros((len(parameters), DIAGNOSTICS))
    args = np.ascontiguousarray(bends), np.ascontiguousarray(half_windows)
    corner_fit()(image, float(white), parameters, *args, tolerance_px, MOST_STEPS, np.empty(WORK_SIZE), found)
    return CornerFit(parameters, found)


def windows(
    fit: CornerFit, lengths: Floats, image_size: tuple[int, int], fraction: float, largest_px: float, clear: float
) -> Floats:
    """Half the window along both edges, and how far from an edge the pattern is a checkerboard's.

    Parameters
    ----------
    fit : CornerFit
    lengths : (n, 2) px
        Of the squares' sides.
    image_size : (int, int)
    fraction, largest_px : float
        The half-window is this part of a square's side, at most so many pixels, and less near the image's border, so
        that it stays symmetric about the corner.
    clear : float
        The part of a square's side, from its edge on, that nothing is printed in; infinite for plain checkerboards.

    Returns
    -------
    (n, 4) px
        NaN where the image's border is too near.
    """
    from opencsp_calib.corner_kernel import RAMP_PX

    halves = np.minimum(fraction * lengths, largest_px)
    reach = ((halves + RAMP_PX)[:, :, None] * np.abs(fit.directions)).sum(axis=1)
    room = np.minimum(fit.pixels, np.array(image_size) - 1 - fit.pixels)
    shrunk = halves * np.minimum(1, (room / reach).min(axis=1))[:, None]
    shrunk[~(shrunk.min(axis=1) >= np.minimum(SMALLEST_HALF_WINDOW_PX, halves.min(axis=1)))] = np.nan
    return np.concatenate([shrunk, np.maximum(clear * lengths - fit.blur_px[:, None], 1.0)], axis=1)
