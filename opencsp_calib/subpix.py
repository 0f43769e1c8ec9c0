"""The seed's sub-pixel search, `cornerSubPix`, with a window that follows the squares: for ``--refine subpix``.

Prefer `opencsp_calib.corners`, which is several times more exact and gives covariances.
"""

from dataclasses import replace

import numpy as np

from opencsp_calib.arrays import Floats, Pixels
from opencsp_calib.detection import Detection
from opencsp_calib.image import Image
from opencsp_calib.opencv import opencv

__all__ = ["refine_subpix"]

LARGEST_HALF_WINDOW_PX = 11
SMALLEST_HALF_WINDOW_PX = 2
STEPS, STEP_PX = 40, 0.001


def refine_subpix(image: Image, detection: Detection) -> Detection:
    """The same corners at the places where the grey levels' gradients point past them.

    The half-window is 11 px, as OpenCSP has it, but never more than half the distance to the nearest other corner: a
    window that reaches the neighbour is drawn towards it.

    Parameters
    ----------
    image : Image
    detection : Detection
        Corners of a checkerboard, within half a window of the truth.

    Returns
    -------
    Detection
        Without covariance: this way gives none. A corner that cannot be searched for stays where it was.
    """
    if len(detection) == 0:
        return detection
    cv2 = opencv()
    grey = image.pixels.astype(np.float32)
    pixels = detection.pixels.astype(np.float32)
    until = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, STEPS, STEP_PX)
    windows = _half_windows(detection.pixels, image.size)
    for half_window in np.unique(windows[windows > 0]):
        chosen = windows == half_window
        size = (int(half_window), int(half_window))
        pixels[chosen] = cv2.cornerSubPix(grey, pixels[chosen].reshape(-1, 1, 2), size, (-1, -1), until).reshape(-1, 2)
    return replace(detection, pixels=pixels.astype(np.float64), covariance=None)


def _half_windows(pixels: Pixels, image_size: tuple[int, int]) -> Floats:
    """(n,) whole pixels; 0 where no window fits, since `cornerSubPix` refuses images smaller than its own."""
    from scipy.spatial import cKDTree

    room = (min(image_size) - 6) // 2
    if len(pixels) < 2:
        halves = np.full(len(pixels), float(LARGEST_HALF_WINDOW_PX))
    else:
        halves = np.floor(cKDTree(pixels).query(pixels, k=2)[0][:, 1] / 2)
    halves = np.clip(halves, SMALLEST_HALF_WINDOW_PX, LARGEST_HALF_WINDOW_PX)
    return np.where(halves <= room, halves, 0)
