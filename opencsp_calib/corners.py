"""Locates the corners of a checkerboard to a hundredth of a pixel, by fitting the image around each.

The steps are: how edges run and how large squares are, from the corners as they were found (`corner_grid`); a fit in
small windows that comes near; how distortion bends the edges, from all corners together (`corner_grid`); the fit in
full windows (`corner_windows`, `corner_kernel`); which of the results are corners (`corner_judgement`), and how sure
(`corner_fit`).
"""

from dataclasses import replace

import numpy as np

from opencsp_calib.arrays import Floats, Mask
from opencsp_calib.board import Board, CharucoBoard
from opencsp_calib.corner_fit import CornerFit, begin
from opencsp_calib.corner_grid import bends, edges
from opencsp_calib.corner_judgement import moved, rejections, summary
from opencsp_calib.corner_windows import FULL, NEAR, SMALL, Surroundings
from opencsp_calib.detection import Detection
from opencsp_calib.errors import InputError
from opencsp_calib.image import Image

__all__ = ["refine"]

CLEAN_MISFIT = 0.08  # of the amplitude; above it a smaller window is tried
SAME_PLACE_PX = 0.5


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
        reason. A pixel's own width counts as blur: a perfectly sharp image has an edge width of 0.29 px.

    Raises
    ------
    InputError
        If a corner's id is not one of the board's.
    """
    if not len(detection):
        return detection
    columns, rows = board.grid
    if not (detection.ids.min() >= 0 and detection.ids.max() < columns * rows):
        raise InputError(f"the detection names a corner that the board, with {columns}x{rows}, does not have")
    vectors, lengths = edges(detection.pixels, detection.ids, columns)
    levels = image.pixels if image.pixels.flags.c_contiguous else image.pixels.copy()
    around = Surroundings(levels, image.white, lengths, np.zeros(lengths.shape), _clear(board))
    start = begin(levels, detection.pixels, vectors)
    near = _near(around, start)
    around, bend_deviations = _better_known(around, near, detection, columns)
    fit = _full(around, near, near.converged & ~moved(near, detection))
    covariance = fit.covariance(bend_deviations)
    verdicts = rejections(fit, start, detection, covariance, around, columns)
    good = np.array([verdict is None for verdict in verdicts])
    rejected = tuple(verdict for verdict in verdicts if verdict is not None)
    return replace(
        detection,
        ids=detection.ids[good],
        pixels=fit.pixels[good],
        covariance=covariance[good],
        edge_width_px=fit.blur_px[good],
        contrast=2 * np.abs(fit.amplitude[good]) / image.white,
        rejected=detection.rejected + rejected,
        reason=summary(rejected, len(verdicts)) or detection.reason,
    )


def _clear(board: Board) -> float:
    """The part of a square's side, from an edge on, in which nothing but the checkerboard is printed."""
    if isinstance(board, CharucoBoard):
        return (1 - board.marker_m / board.spacing_m) / 2
    return np.inf


def _near(around: Surroundings, start: CornerFit) -> CornerFit:
    """From where corners were found to a tenth of a pixel: in small windows; where they fail, in full ones."""
    everywhere = np.ones(len(start.parameters), dtype=bool)
    near = around.fit(start, NEAR, everywhere, examine=False)
    lost = ~near.converged
    return near.replaced(lost, around.fit(start, FULL, lost, examine=False)[lost])


def _better_known(
    around: Surroundings, near: CornerFit, detection: Detection, columns: int
) -> tuple[Surroundings, Floats]:
    """The size of squares and the bend of edges by corners known to a tenth of a pixel; the bends' deviations."""
    known = near.converged & ~moved(near, detection)
    lengths, bent, deviations = around.lengths.copy(), around.bends.copy(), np.zeros(around.bends.shape)
    if known.any():
        where = near.pixels[known], detection.ids[known], columns
        lengths[known] = edges(*where)[1]
        bent[known], deviations[known] = bends(*where)
    return replace(around, lengths=lengths, bends=bent), deviations


def _full(around: Surroundings, near: CornerFit, where: Mask) -> CornerFit:
    """The final fit: in full windows; where something disturbs them, in small ones.

    Small windows must confirm about the same place: a spot on a corner makes new corners beside it, which only edges
    farther away belie.
    """
    fit = around.fit(near, FULL, where)
    disturbed = where & ~(fit.converged & (fit.misfit < CLEAN_MISFIT))
    small = around.fit(near, SMALL, disturbed)
    same = np.linalg.norm(small.pixels - fit.pixels, axis=1) < SAME_PLACE_PX
    better = fit.converged & small.converged & same & (small.misfit < 0.75 * fit.misfit)
    return fit.replaced(better, small[better])
