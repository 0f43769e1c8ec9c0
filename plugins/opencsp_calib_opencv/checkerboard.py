"""Finds plain checkerboards, whole or in part."""

from typing import Literal

from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.detection import Detection
from opencsp_calib.image import Image
from opencsp_calib_opencv.available import missing_opencv
from opencsp_calib_opencv.explaining import emptiness, incomplete, not_placed, two_boards
from opencsp_calib_opencv.grid import count
from opencsp_calib_opencv.levels import levels
from opencsp_calib_opencv.margins import sides_seen
from opencsp_calib_opencv.placing import placed
from opencsp_calib_opencv.search import found_grids

__all__ = ["CheckerboardDetector"]

MUCH_LARGER = 2.0  # times: a board whose squares are so much smaller is in the background, or on a screen


class CheckerboardDetector:
    """Finds plain checkerboards: saddles of the grey levels, joined along edges to grids, identified by their margins.

    The photograph is searched reduced, then finer and finer until the whole board is found; every level costs at most a
    tenth of a second, whether there is a board or not. Each corner must look like one, stand on the lines of its
    neighbours and fit a smooth projection. A board that is partly out of view or covered gives the corners that can be
    told for certain, see `placing`; where it cannot be told which they are, it gives none.

    Corners are good to a pixel or better, to be refined by `opencsp_calib.corners`.

    Notes
    -----
    Some things a plain checkerboard does not tell. One of 23x18 is one of 18x23, turned: either name finds it, and only
    the ids differ. A mirror image or a print in white on black is a checkerboard again, of the same columns and rows.
    Where columns and rows are both even or both odd it looks the same upside down; see `placing` for the end at which
    ids begin then.
    """

    name = "checkerboard"
    feature: Literal["corner", "own"] = "corner"

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        return missing_opencv()

    def supports(self, board: Board) -> bool:
        """Plain checkerboards only."""
        return isinstance(board, Checkerboard)

    def detect(self, image: Image, board: Board) -> Detection:
        """The corners that can be told for certain; fewer than all, or none, with the reason."""
        best, largest, whole = Detection.nothing(""), None, False
        for level in levels(image, len(board.points)):
            grids = found_grids(level, board)
            fits = [fit for grid in grids if (fit := placed(level.grey, grid, board))]
            fits.sort(key=lambda fit: fit.square_px, reverse=True)
            if len(fits) > 1 and fits[1].square_px * MUCH_LARGER > fits[0].square_px:
                return Detection.nothing(two_boards(board))
            if fits and len(fits[0].ids) > len(best):
                ids, pixels = fits[0].ids, level.to_image(fits[0].pixels)
                best = Detection(ids, pixels, reason=incomplete(len(ids), board))
            if len(best) == len(board.points):
                break
            if grids and (largest is None or count(grids[0]) > count(largest)):
                largest, whole = grids[0], all(sides_seen(level.grey, grids[0]))
        if len(best):
            return best
        empty = emptiness(image)
        return Detection.nothing(empty) if empty else not_placed(board, largest, whole)
