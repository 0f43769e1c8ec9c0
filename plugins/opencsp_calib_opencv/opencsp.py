"""OpenCSP's own way of finding a checkerboard, kept to the letter for ``--preset opencsp``."""

from typing import Literal

import numpy as np

from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.detection import Detection
from opencsp_calib.image import Image
from opencsp_calib_opencv.available import missing_opencv
from opencsp_calib_opencv.grey import eight_bit

__all__ = ["OpenCSPDetector"]

HALF_WINDOW_PX = 11
STEPS, STEP_PX = 40, 0.001


class OpenCSPDetector:
    """`findChessboardCorners`, then `cornerSubPix` with one window for every board: what OpenCSP's window does.

    It keeps OpenCV's order of corners, whichever end that begins at, and its corners are taken as they come (feature
    ``own``), so that a calibration with it can be compared with OpenCSP's figure for figure. Prefer ``checkerboard``.
    """

    name = "opencsp"
    feature: Literal["corner", "own"] = "own"

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        return missing_opencv()

    def supports(self, board: Board) -> bool:
        """Plain checkerboards only."""
        return isinstance(board, Checkerboard)

    def detect(self, image: Image, board: Board) -> Detection:
        """All corners of the board, or none."""
        import cv2

        pixels = eight_bit(image)
        # OpenCSP asks for a fast check too, but its flags land in the place of another argument, so that OpenCV's
        # defaults are what it really runs with; they find more, and sooner
        flags = cv2.CALIB_CB_ADAPTIVE_THRESH + cv2.CALIB_CB_NORMALIZE_IMAGE
        if min(pixels.shape) <= 2 * HALF_WINDOW_PX + 5:  # cornerSubPix refuses images no larger than its window
            return Detection.nothing(f"the image is only {image.size[0]}x{image.size[1]} pixels")
        found, corners = cv2.findChessboardCorners(pixels, board.grid, flags=flags)
        if not found:
            return Detection.nothing(f"OpenCSP's search found no {board.columns}x{board.rows} checkerboard")
        until = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, STEPS, STEP_PX)
        corners = cv2.cornerSubPix(pixels, corners, (HALF_WINDOW_PX, HALF_WINDOW_PX), (-1, -1), until)
        return Detection(np.arange(len(board.points)), corners.reshape(-1, 2))
