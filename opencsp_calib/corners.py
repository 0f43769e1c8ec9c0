"""Locates the corners of a checkerboard to a hundredth of a pixel, by fitting the image around each.

The model of the image is in `opencsp_calib.corner_kernel`; here is what leads to it (how large a window, how bent the
edges) and what follows from it (which results are corners, and how far to trust them).
"""

from collections import Counter
from dataclasses import replace

import numpy as np

from opencsp_calib.arrays import Covariances, Floats
from opencsp_calib.board import Board, CharucoBoard
from opencsp_calib.compiled import prepare
from opencsp_calib.corner_fit import CornerFit, begin, improve, windows
from opencsp_calib.corner_grid import bends, edges, parity
from opencsp_calib.detection import Detection, RejectedCorner
from opencsp_calib.image import Image

__all__ = ["prepare", "refine"]

# Half-windows as part of a square's side, and at most, px; the first fit has only to come near.
NEAR_FRACTION, NEAR_PX, NEAR_TOLERANCE_PX = 0.5, 7.0, 0.03
FULL_FRACTION, FULL_PX, FULL_TOLERANCE_PX = 0.7, 14.0, 0.002
# For what is disturbed within the full window: outer squares of half a width, dirt, the edge of a shadow.
SMALL_FRACTION, SMALL_PX, CLEAN_MISFIT = 0.35, 7.0, 0.08

# What is no corner. The limits are far from both sides: a corner leaves 0.05 at most, half a covered quarter 0.5.
MOST_MOVED_PX = 3.0
MOST_QUADRANT_MISFIT = 0.2
MOST_UNEVEN_SATURATION = 0.3
MOST_MISFIT = 0.15
MOST_BLUR_FRACTION = 0.5
MOST_DEVIATION_PX = 0.3


def refine(image: Image, detection: Detection, board: Board) -> Detection:
    """Where exactly the corners of a checkerboard are, and how far to trust that.

    Parameters
    ----------
    image : Image
    detection : Detection
        Corners as any detector found them, within 2 px.
    board : Board
        A board whose corners have two black and two white squares around them, in a regular grid.

    Returns
    -------
    Detection
        The corners that look like corners, with covariance, edge width and contrast; the others in `rejected`, with the
        reason. A pixel's area counts as blur: a perfectly sharp image has an edge width of 0.29 px.
    """
    if not len(detection):
        return detection
    grey = np.ascontiguousarray(image.pixels, dtype=np.uint16)
    columns = board.grid[0]
    clear = _clear_fraction(board)

    vectors, lengths = edges(detection.pixels, detection.ids, columns)
    start = begin(grey, detection.pixels, vectors)
    halves = windows(start, lengths, image.size, NEAR_FRACTION, NEAR_PX, clear)
    near = improve(grey, image.white, start, np.zeros(lengths.shape), halves, NEAR_TOLERANCE_PX)

    came_near = near.converged & (_moved(near, detection) < MOST_MOVED_PX)
    bent, deviations = np.zeros(lengths.shape), np.zeros(lengths.shape)
    if came_near.any():
        known = near.pixels[came_near], detection.ids[came_near], columns
        lengths[came_near] = edges(*known)[1]
        bent[came_near], deviations[came_near] = bends(*known)
    halves = windows(near, lengths, image.size, FULL_FRACTION, FULL_PX, clear)
    halves[~came_near] = np.nan
    fit = improve(grey, image.white, near, bent, halves, FULL_TOLERANCE_PX)
    disturbed = np.flatnonzero(came_near & ~(fit.converged & (fit.misfit < CLEAN_MISFIT)))
    halves = windows(near, lengths, image.size, SMALL_FRACTION, SMALL_PX, clear)[disturbed]
    small = improve(grey, image.white, near[disturbed], bent[disturbed], halves, FULL_TOLERANCE_PX)
    better = small.converged & ~(fit[disturbed].converged & (small.misfit > fit[disturbed].misfit / 2))
    fit = fit.replaced(disturbed[better], small[better])
    covariance = fit.covariance(deviations)
    reasons = _reasons(fit, detection, covariance, lengths, columns)
    return _judged(image, detection, fit, covariance, reasons)


def _clear_fraction(board: Board) -> float:
    """The part of a square's side, from an edge on, in which nothing but the checkerboard is printed."""
    if isinstance(board, CharucoBoard):
        return (1 - board.marker_m / board.spacing_m) / 2
    return np.inf


def _moved(fit: CornerFit, detection: Detection) -> Floats:
    return np.asarray(np.linalg.norm(fit.pixels - detection.pixels, axis=1))


def _reasons(fit: CornerFit, detection: Detection, covariance: Covariances, lengths: Floats, columns: int) -> list[str]:
    """Why each is no corner to be trusted; empty where it is one."""
    colours = np.sign(fit.amplitude) * parity(detection.ids, columns)
    usual = np.sign(colours[fit.converged].sum())
    deviation = np.sqrt(np.trace(covariance, axis1=1, axis2=2))
    # quadrants 0 and 3 are of one colour, 1 and 2 of the other
    saturation = fit.quadrant_saturation
    uneven = np.maximum(np.abs(saturation[:, 0] - saturation[:, 3]), np.abs(saturation[:, 1] - saturation[:, 2]))
    misfit = fit.quadrant_misfit
    conditions = {
        "no corner beside it tells how large its squares are": ~np.isfinite(lengths).all(axis=1),
        "at the image border": fit.outside,
        "does not look like a corner": ~fit.converged,
        "black and white are exchanged": colours != usual,
        "moved too far from where it was found": _moved(fit, detection) > MOST_MOVED_PX,
        "too little contrast": ~(deviation < MOST_DEVIATION_PX),
        "too blurred": fit.blur_px > MOST_BLUR_FRACTION * lengths.min(axis=1),
        "glare": (uneven > MOST_UNEVEN_SATURATION) | (misfit.max(axis=1) > MOST_QUADRANT_MISFIT),
        "occluded": misfit.min(axis=1) < -MOST_QUADRANT_MISFIT,
        "too unlike a corner": fit.misfit > MOST_MISFIT,
    }
    return [str(reason) for reason in np.select(list(conditions.values()), list(conditions), default="")]


def _judged(
    image: Image, detection: Detection, fit: CornerFit, covariance: Covariances, reasons: list[str]
) -> Detection:
    good = np.array([not reason for reason in reasons])
    rejected = tuple(
        RejectedCorner(int(detection.ids[i]), (float(detection.pixels[i, 0]), float(detection.pixels[i, 1])), reason)
        for i, reason in enumerate(reasons)
        if reason
    )
    return replace(
        detection,
        ids=detection.ids[good],
        pixels=fit.pixels[good],
        covariance=covariance[good],
        edge_width_px=fit.blur_px[good],
        contrast=2 * np.abs(fit.amplitude[good]) / image.white,
        rejected=detection.rejected + rejected,
        reason=_summary(rejected, len(reasons)) or detection.reason,
    )


def _summary(rejected: tuple[RejectedCorner, ...], of: int) -> str:
    if not rejected:
        return ""
    counts = Counter(corner.reason for corner in rejected).most_common()
    return f"{len(rejected)} of {of} corners rejected: " + ", ".join(f"{n} {reason}" for reason, n in counts)
