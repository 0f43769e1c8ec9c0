"""Finds circle grids with OpenCV."""

import numpy as np

from opencsp_calib import Detection
from opencsp_calib_circles.board import CircleGrid


class CircleGridDetector:
    """OpenCV's `findCirclesGrid`.

    It takes the middle of each disc's image. That is not quite the image of its middle: a disc that is seen askew is
    nearer on one side. So circle grids are good to a tenth of a pixel or two, and checkerboards are better.
    """

    name = "circles"
    feature = "own"  # centres come as they are; only corners of checkerboards are refined

    def missing(self):
        """What to install where it cannot run."""
        try:
            import cv2  # noqa: F401  # never at the top: to list plugins must not load OpenCV
        except ImportError:
            return "it needs OpenCV: pip install 'opencsp-calib[opencv]'"
        return None

    def supports(self, board):
        """Circle grids only."""
        return isinstance(board, CircleGrid)

    def detect(self, image, board):
        """The whole grid, or nothing and why."""
        import cv2

        grey = np.rint(np.minimum(image.pixels * (255.0 / image.white), 255.0)).astype(np.uint8)
        try:
            found, centres = cv2.findCirclesGrid(
                grey, board.grid, flags=cv2.CALIB_CB_SYMMETRIC_GRID, blobDetector=_blobs(cv2, grey, board)
            )
        except cv2.error as error:
            return Detection.nothing(f"OpenCV cannot search this image: {error.err}")
        if not found:
            return Detection.nothing(f"no grid of {board.columns}x{board.rows} circles was found")
        return Detection(np.arange(len(board.points)), _as_seen_from_the_front(centres, board))


def _blobs(cv2, grey, board):
    """Discs of any size that fits; by itself OpenCV takes none larger than 5000 square pixels."""
    wanted = cv2.SimpleBlobDetector_Params()
    wanted.minArea, wanted.maxArea = 12.0, grey.size / len(board.points)
    wanted.minDistBetweenBlobs = 4.0
    return cv2.SimpleBlobDetector_create(wanted)


def _as_seen_from_the_front(centres, board):
    """(n, 2) in the order of ids: OpenCV may name a row from its other end, as if the board were a mirror image."""
    rows = centres.reshape(board.rows, board.columns, 2).astype(np.float64)
    along, down = rows[0, -1] - rows[0, 0], rows[-1, 0] - rows[0, 0]
    mirrored = along[0] * down[1] - along[1] * down[0] < 0
    return (rows[:, ::-1] if mirrored else rows).reshape(-1, 2)
