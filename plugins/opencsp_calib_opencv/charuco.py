"""Finds ChArUco boards, whole or in part."""

from typing import Literal

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.board import Board, CharucoBoard
from opencsp_calib.detection import Detection
from opencsp_calib.image import Image
from opencsp_calib_opencv.available import missing_opencv
from opencsp_calib_opencv.charuco_explaining import why_no_charuco
from opencsp_calib_opencv.explaining import emptiness, incomplete
from opencsp_calib_opencv.grid import known, square_height
from opencsp_calib_opencv.growth import belongs, filled
from opencsp_calib_opencv.layout import Layout, laid_out, read_board
from opencsp_calib_opencv.levels import Level, finest_level
from opencsp_calib_opencv.markers import cells_of, dictionary_size, found_quads
from opencsp_calib_opencv.neighbours import Neighbours
from opencsp_calib_opencv.saddles import saddle_pixels
from opencsp_calib_opencv.smoothness import smooth_part

__all__ = ["CharucoDetector"]

REACH = 0.25  # of the squares' height: how far a corner may be from where the markers foretell it
MOST_RING = 0.3  # of the squares' height
INTO_CORNER = 1.2  # markers stand back from both edges; towards a corner there is half as much more room


class CharucoDetector:
    """Finds a ChArUco board by its markers; a part of it that shows two of them side by side is enough.

    The markers foretell the corners between them. Each corner must be a saddle of the grey levels there, look like a
    corner, and fit a smooth projection with the others; it may stand beside markers that cannot be read.

    Corners are good to a pixel or better, to be refined by `opencsp_calib.corners`.
    """

    name = "charuco"
    feature: Literal["corner", "own"] = "corner"

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        return missing_opencv()

    def supports(self, board: Board) -> bool:
        """ChArUco boards only."""
        return isinstance(board, CharucoBoard)

    def detect(self, image: Image, board: Board) -> Detection:
        """The corners of the board that are in view; none, with the reason, where it is another board or none."""
        if not isinstance(board, CharucoBoard):
            return Detection.nothing(f"a board of kind {board.kind!r} is not looked for by its markers")
        level = finest_level(image)
        if level is None:
            return Detection.nothing(emptiness(image) or f"the image is only {image.size[0]}x{image.size[1]} pixels")
        quads = found_quads(level, inverted=board.inverted)
        if quads is None:
            return Detection.nothing("too many small dark shapes are in view to look for markers among them")
        cells = cells_of(level, quads, dictionary_size(board.dictionary), inverted=board.inverted)
        markers = read_board(cells, board)
        layout = laid_out(markers, board)
        if not layout.fits:
            return Detection.nothing(emptiness(image) or why_no_charuco(level, board, quads, markers))
        grid = _corners(level, board, layout)
        ids = np.flatnonzero(known(grid))
        return Detection(ids, level.to_image(grid.reshape(-1, 2)[ids]), reason=incomplete(len(ids), board))


def _corners(level: Level, board: CharucoBoard, layout: Layout) -> Floats:
    """(rows, columns, 2) px of the level."""
    saddles = saddle_pixels(level.grey, most=5000 + 40 * len(board.points))
    there = known(layout.corners)
    off, nearest = (found[:, 0] for found in Neighbours(saddles).nearest(layout.corners[there]))
    grid = np.full_like(layout.corners, np.nan)
    grid[there] = saddles[nearest]
    clear = (1 - board.marker_m / board.spacing_m) / 2
    ring = min(MOST_RING, INTO_CORNER * clear)
    far = np.zeros_like(there)
    far[there] = off > REACH * np.nan_to_num(square_height(layout.corners)[there])
    grid[far] = np.nan
    grid[~belongs(level.grey, grid, ring)] = np.nan
    return smooth_part(filled(level.grey, grid, saddles, ring))
