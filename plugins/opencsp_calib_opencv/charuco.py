"""Finds ChArUco boards, whole or in part."""

from typing import Any, Literal

import numpy as np

from opencsp_calib.board import Board, CharucoBoard
from opencsp_calib.detection import Detection
from opencsp_calib.image import Image
from opencsp_calib_opencv.available import missing_opencv
from opencsp_calib_opencv.grey import eight_bit

__all__ = ["CharucoDetector"]


class CharucoDetector:
    """Finds a ChArUco board by its markers; any part of it that shows a few of them is enough."""

    name = "charuco"
    feature: Literal["corner", "own"] = "corner"

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        return missing_opencv()

    def supports(self, board: Board) -> bool:
        """ChArUco boards only."""
        return isinstance(board, CharucoBoard)

    def detect(self, image: Image, board: Board) -> Detection:
        """The corners between markers that were recognised."""
        import cv2

        if not isinstance(board, CharucoBoard):
            return Detection.nothing(f"this detector does not know boards of kind {board.kind}")
        pixels = eight_bit(image)
        pixels = ~pixels if board.inverted else pixels
        corners, ids, _, markers = cv2.aruco.CharucoDetector(_opencv_board(board)).detectBoard(pixels)
        if ids is None or len(ids) == 0:
            seen = 0 if markers is None else len(markers)
            return Detection.nothing(f"no corner of the ChArUco board was found ({seen} of its markers were)")
        return Detection(np.ravel(ids), np.reshape(corners, (-1, 2)))


def _opencv_board(board: CharucoBoard) -> Any:
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    made = cv2.aruco.CharucoBoard((board.columns, board.rows), board.spacing_m, board.marker_m, dictionary)
    made.setLegacyPattern(board.legacy)
    return made
