"""OpenCV's sub-pixel search, `cornerSubPix`, for the studies that hold our corners against it."""

import cv2
import numpy as np

UNTIL = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 40, 0.001)  # as OpenCSP has it


def by_subpix(grey: np.ndarray, start: np.ndarray, half_window: int) -> np.ndarray:
    """Where it moves corners.

    Parameters
    ----------
    grey : (height, width) of any depth
    start : (n, 2) px
    half_window : int
        Pixels.

    Returns
    -------
    (n, 2) px, float32
    """
    grey, start = np.asarray(grey, np.float32), start.astype(np.float32)  # the second is written over
    return cv2.cornerSubPix(grey, start, (half_window, half_window), (-1, -1), UNTIL).reshape(-1, 2)
