"""The nearest of many pixels, by OpenCV's exact search tree: SciPy's takes half a second to import."""

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Pixels

__all__ = ["Neighbours"]

KDTREE_SINGLE = 4  # of FLANN's algorithms the exact one for few dimensions; cv2 has no name for it
EVERY_LEAF = -1


class Neighbours:
    """Pixels (n, 2), n > 0, to be asked which of them are nearest; distances are good to a thousandth of a pixel."""

    def __init__(self, pixels: Pixels) -> None:
        import cv2

        self.pixels = pixels
        self._single = np.ascontiguousarray(pixels, dtype=np.float32)  # kept: the index only points to it
        self._index = vars(cv2)["flann_Index"](self._single, {"algorithm": KDTREE_SINGLE})

    def nearest(self, wanted: Pixels, count: int = 1) -> tuple[Floats, Ids]:
        """(m, count) px distances from the pixels (m, 2), nearest first, and the indices of those; count <= n."""
        if not len(wanted):  # which OpenCV refuses
            return np.zeros((0, count)), np.zeros((0, count), dtype=np.int64)
        places = np.ascontiguousarray(wanted, dtype=np.float32)
        indices, squares = self._index.knnSearch(places, count, params={"checks": EVERY_LEAF})
        return np.sqrt(squares, dtype=np.float64), np.asarray(indices, dtype=np.int64)
