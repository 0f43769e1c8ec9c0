"""Where a ChArUco board's corners should be, told by its markers; and whether these are on such a board at all."""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.board import CharucoBoard
from opencsp_calib_opencv.board_kinds import opencv_board
from opencsp_calib_opencv.markers import Cells, Markers, quad_areas, read_markers

__all__ = ["Layout", "laid_out", "read_board"]

MOST_APART = 0.25  # of a square: how far two markers may disagree on a corner; another layout is off by 1
LEAST_AGREEMENT = 0.8  # of the corners that two markers foretell
AROUND = np.array([[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]])  # a square's corners, from its middle


@dataclass(frozen=True, eq=False)
class Layout:
    """What markers say about the corners of a board.

    Parameters
    ----------
    corners : (rows, columns, 2) px
        Foretold by the markers beside them; NaN where there is none, or two disagree.
    agreeing, disagreeing : int
        Corners between two markers on which these do, or do not, agree.
    """

    corners: Floats
    agreeing: int
    disagreeing: int

    @property
    def fits(self) -> bool:
        """Whether the markers are arranged as on the board."""
        return self.agreeing > 0 and self.agreeing >= LEAST_AGREEMENT * (self.agreeing + self.disagreeing)


def read_board(cells: Cells, board: CharucoBoard, *, mirrored: bool = False) -> Markers:
    """The markers of the board among the cells; or their images in a mirror."""
    count = board.columns * board.rows // 2  # one in every other square
    return read_markers(cells, board.dictionary, count, mirrored=mirrored)


def laid_out(markers: Markers, board: CharucoBoard) -> Layout:
    """What the markers say about the corners, if they are of this board."""
    import cv2

    columns, rows = board.grid
    places = _marker_corners(board)
    known = markers.ids < len(places)
    foretold: list[list[list[Floats]]] = [[[] for _ in range(columns)] for _ in range(rows)]
    for flat, seen in zip(places[markers.ids[known]], markers.corners[known], strict=True):
        around = np.rint(flat.mean(axis=0) + AROUND)
        homography = cv2.getPerspectiveTransform(flat.astype(np.float32), seen.astype(np.float32))
        pixels = cv2.perspectiveTransform(around[None], homography)[0]
        for (x, y), pixel in zip(around.astype(int), pixels, strict=True):
            if 0 <= x < columns and 0 <= y < rows:
                foretold[y][x].append(pixel)
    marker_px = np.sqrt(np.median(quad_areas(markers.corners))) if len(markers.ids) else 0.0
    return _agreed(foretold, MOST_APART * marker_px * board.spacing_m / board.marker_m)


def _agreed(foretold: list[list[list[Floats]]], most_apart_px: float) -> Layout:
    corners = np.full((len(foretold), len(foretold[0]), 2), np.nan)
    agreeing = disagreeing = 0
    for y, row in enumerate(foretold):
        for x, pixels in enumerate(row):
            if len(pixels) > 1 and np.ptp(pixels, axis=0).max() > most_apart_px:
                disagreeing += 1
                continue
            agreeing += len(pixels) > 1
            if pixels:
                corners[y, x] = np.mean(pixels, axis=0)
    return Layout(corners, agreeing, disagreeing)


def _marker_corners(board: CharucoBoard) -> Floats:
    """(n, 4, 2) corners of each marker, in squares from the corner with id 0, along columns and rows."""
    made = opencv_board(board)
    corners = np.array(made.getObjPoints(), dtype=np.float64)[:, :, :2] / board.spacing_m - 1
    ordered = np.empty_like(corners)
    ordered[np.ravel(made.getIds())] = corners
    return ordered
