"""Which corners are outliers: weights that let go of them while solving, and a limit beyond which they are named.

While solving, corners count by Cauchy's weights, on a scale taken from the median of all residuals, so that nearly half
of them could be wrong. In the end, what lies beyond `LIMIT` times the scale is left out entirely and the rest is
solved by least squares, so that the answer is as precise as without outliers and its covariance means something.

The limit is on the scale of the set or of the view, whichever is larger: a view that is worse as a whole (blurred, or
close to a board that is not as flat as it is taken for) is a matter for judging views, not corners. Only where it is
worse than `RUBBISH` times the set is nothing of it taken for good.
"""

import numpy as np

from opencsp_calib.arrays import Floats, Mask
from opencsp_calib.corner_table import CornerTable

__all__ = ["LIMIT", "outlying", "weights"]

LIMIT = 6.0
"""In standard deviations per axis. Of independent normal errors, 1.5 in 100 million lie beyond."""
RUBBISH = 5.0
CAUCHY = 2.385  # standard deviations; keeps 95 % of the precision where errors are normal
MEDIAN_LENGTH = 1.17741  # of vectors of two normal errors, in standard deviations
SMALLEST_PX = 1e-6  # errors below are of no interest, even where all others are smaller


def weights(table: CornerTable, residuals: Floats) -> tuple[Floats, float]:
    """(N,) factors for whitened residuals by Cauchy's loss, from residuals (N, 2) px, and the scale of the set."""
    lengths, scale = _lengths(table, residuals)
    return 1.0 / np.sqrt(1.0 + (lengths / (CAUCHY * scale)) ** 2), scale


def outlying(table: CornerTable, residuals: Floats) -> Mask:
    """(N,) which corners lie beyond the limit, from residuals (N, 2) px; all that have no image do."""
    lengths, scale = _lengths(table, residuals)
    of_views = np.array([np.median(part) for part in np.split(lengths, table.first[1:-1])]) / MEDIAN_LENGTH
    limits = LIMIT * np.where(of_views > RUBBISH * scale, scale, np.maximum(scale, of_views))
    return lengths > np.repeat(limits, table.counts)


def _lengths(table: CornerTable, residuals: Floats) -> tuple[Floats, float]:
    """(N,) lengths of the whitened residuals, and the standard deviation per axis that their median tells of."""
    lengths = table.whitened_lengths(residuals)
    lengths[np.isnan(lengths)] = np.inf
    return lengths, max(float(np.median(lengths)) / MEDIAN_LENGTH, SMALLEST_PX * table.typical_weight)
