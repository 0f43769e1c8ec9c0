"""What a fit says of many corners at once: where they are, how blurred, how sure; and where a fit begins."""

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Covariances, Floats, Ids, Mask, Pixels
from opencsp_calib.corner_kernel import DIAGNOSTICS, PARAMETERS

__all__ = ["CornerFit", "Levels", "begin"]

Levels: TypeAlias = NDArray[np.uint8] | NDArray[np.uint16]  # (height, width)

FIRST_BLUR_PX = 1.5
ROUNDING = 1 / 12  # variance of grey levels: the least noise an image can have
MOST_NOISE = 1.4  # how far the variance of one corner's noise may be above the usual by chance
STAIN_PIXELS = 50.0  # that pull as one
HIDDEN_BY_SATURATION = 0.12  # of the edge width: what a change of the light moves that saturated pixels do not show


@dataclass(frozen=True, eq=False)
class CornerFit:
    """The parameters of the image of each corner, and how they were found; see `opencsp_calib.corner_kernel`.

    Parameters
    ----------
    parameters : (n, 11)
    diagnostics : (n, 23)
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
    def dark(self) -> Floats:
        """(n,) grey level of the darker squares."""
        return np.asarray(self.parameters[:, 5] - np.abs(self.amplitude))

    @property
    def converged(self) -> Mask:
        """(n,) whether there is a result."""
        return np.asarray(self.diagnostics[:, 0] == 0)

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

        Noise, how well bends are known, and what saturation hides.
        """
        xx, xy, yy = self.diagnostics[:, 3:6].T
        unit = np.stack([np.stack([xx, xy], axis=-1), np.stack([xy, yy], axis=-1)], axis=-2)
        response = self.diagnostics[:, 6:10].reshape(-1, 2, 2) * bend_deviations[:, None, :]
        hidden = HIDDEN_BY_SATURATION * self.blur_px * self.quarter_saturation.max(axis=1)
        covariance = unit * self._pulling_variance[:, None, None] + response @ response.transpose(0, 2, 1)
        return np.asarray(covariance + hidden[:, None, None] ** 2 * np.eye(2))

    @property
    def _pulling_variance(self) -> Floats:
        """(n,) of independent pixels that would move the corner as much as these do.

        Where the noise of neighbours is correlated, so are their pulls: fully along the edge, less across, where the
        pull is a Gaussian's derivative. What one corner leaves beyond the image's usual is a stain or a reflection, and
        of a size that pulls as one.
        """
        correlation = self.correlation
        across = np.exp(-1 / (4 * self.blur_px**2))
        stain = np.maximum(self.variance - MOST_NOISE * self.noise_variance / (1 - correlation), 0)
        return np.asarray(self.variance * (1 + 2 * correlation) * (1 + 2 * correlation * across) + STAIN_PIXELS * stain)

    def replaced(self, where: Ids | Mask, other: "CornerFit") -> "CornerFit":
        """The same with other fits (m) at some places (m,)."""
        parameters, diagnostics = self.parameters.copy(), self.diagnostics.copy()
        parameters[where], diagnostics[where] = other.parameters, other.diagnostics
        return CornerFit(parameters, diagnostics)

    def __getitem__(self, where: Ids | Mask) -> "CornerFit":
        return CornerFit(self.parameters[where], self.diagnostics[where])

    @property
    def quarter_misfit(self) -> Floats:
        """(n, 4) mean residual in each quarter of the window, as a fraction of the amplitude."""
        return self.diagnostics[:, 10:14]

    @property
    def quarter_saturation(self) -> Floats:
        """(n, 4) share of saturated pixels in each quarter of the window."""
        return self.diagnostics[:, 14:18]


def begin(image: Levels, pixels: Pixels, vectors: Floats) -> CornerFit:
    """A first guess: grey levels read at a few places in each of the four squares around a corner.

    Parameters
    ----------
    image : (height, width)
    pixels : (n, 2)
    vectors : (n, 2, 2) px
        To the next corner along the two edges.
    """
    height, width = image.shape
    far = np.array([-0.4, -0.3, -0.2, 0.2, 0.3, 0.4])
    vectors = np.nan_to_num(vectors)
    along_row, along_column = far[:, None] * vectors[:, None, 0], far[:, None] * vectors[:, None, 1]
    places = pixels[:, None, None] + along_row[:, :, None] + along_column[:, None, :]
    x, y = np.rint(np.clip(places, 0, (width - 1, height - 1))).astype(np.int64).transpose(3, 0, 1, 2)
    levels = image[y, x].astype(np.float64)
    same_side = np.sign(far)[:, None] * np.sign(far)
    parameters = np.zeros((len(pixels), PARAMETERS))
    parameters[:, :2] = pixels
    parameters[:, 2:4] = np.arctan2(vectors[..., 1], vectors[..., 0])
    parameters[:, 4] = FIRST_BLUR_PX
    parameters[:, 5] = levels.mean(axis=(1, 2))
    parameters[:, 6] = -(levels * same_side).mean(axis=(1, 2))
    return CornerFit(parameters, np.full((len(pixels), DIAGNOSTICS), np.nan))
