"""Finds plain checkerboards."""

from collections.abc import Callable, Iterator
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats
from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.detection import Detection
from opencsp_calib.image import Image
from opencsp_calib_opencv.available import missing_opencv
from opencsp_calib_opencv.grey import eight_bit
from opencsp_calib_opencv.ordering import first_corner_first

__all__ = ["CheckerboardDetector"]


class CheckerboardDetector:
    """Finds plain checkerboards, quick searches first."""

    name = "checkerboard"
    feature: Literal["corner", "own"] = "corner"

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        return missing_opencv()

    def supports(self, board: Board) -> bool:
        """Plain checkerboards only."""
        return isinstance(board, Checkerboard)

    def detect(self, image: Image, board: Board) -> Detection:
        """All corners of the board, ready to be refined, or none."""
        pixels = eight_bit(image)
        for search in _searches():
            grid = search(pixels, board.columns, board.rows)
            if grid is not None:
                ordered = first_corner_first(pixels, grid, board.columns, board.rows)
                if ordered is not None:
                    return Detection(np.arange(len(board.points)), ordered.reshape(-1, 2))
        return Detection.nothing(f"no {board.columns}x{board.rows} checkerboard was found")


Search = Callable[[NDArray[np.uint8], int, int], Floats | None]


def _searches() -> Iterator[Search]:
    import cv2

    def classic(pixels: NDArray[np.uint8], columns: int, rows: int) -> Floats | None:
        flags = cv2.CALIB_CB_ADAPTIVE_THRESH + cv2.CALIB_CB_FAST_CHECK + cv2.CALIB_CB_NORMALIZE_IMAGE
        found, corners = cv2.findChessboardCorners(pixels, (columns, rows), flags=flags)
        return corners.reshape(rows, columns, 2).astype(np.float64) if found else None

    def robust(pixels: NDArray[np.uint8], columns: int, rows: int) -> Floats | None:
        found, corners = cv2.findChessboardCornersSB(pixels, (columns, rows))
        return corners.reshape(rows, columns, 2).astype(np.float64) if found else None

    yield classic
    yield robust
