"""One frame of the live picture: the board in it, found quickly, how much it moves, and what is wrong with it.

The board is looked for in a reduced image, which is as good for a gauge as the whole one and several times quicker;
what has been photographed is looked at again in full. Where nothing was found, the next frame is reduced less: a small
board costs a frame or two, once.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from opencsp_calib.arrays import Floats, Pixels
from opencsp_calib.board import Board
from opencsp_calib.detection import Detection, Problem
from opencsp_calib.image import Image
from opencsp_calib.images import reduced
from opencsp_calib.interfaces import Detector
from opencsp_calib.looking import find_board
from opencsp_calib.photograph import problems_of

__all__ = ["Glance", "Preview", "motion_px"]

QUICK_PX, CAREFUL_PX = 250_000, 700_000  # pixels of the reduced image
FEWEST_IN_COMMON = 4  # corners of two frames that tell how the board has moved


@dataclass(frozen=True, eq=False)
class Glance:
    """What one frame shows of the board.

    Parameters
    ----------
    image : Image
    detection : Detection
        In pixels of the whole image, good to about a pixel.
    motion_px : float
        How far the corners have moved from one frame to the next, rms, the larger of the last two times: a hand that
        turns back stands still for a moment. NaN where that is not known.
    problems : tuple of Problem
        What is wrong with it as a photograph: blur, light, size, place.
    """

    image: Image = field(repr=False)
    detection: Detection = field(repr=False)
    motion_px: float
    problems: tuple[Problem, ...]


class Preview:
    """Looks at frame after frame.

    Parameters
    ----------
    board : Board
    detector : Detector
    """

    def __init__(self, board: Board, detector: Detector) -> None:
        self._board, self._detector = board, detector
        self._pixels = QUICK_PX
        self._last, self._moved_px = Detection.nothing(""), float("nan")

    def look(self, image: Image) -> Glance:
        """What this frame shows."""
        factor = max(1, int(np.ceil(np.sqrt(image.pixels.size / self._pixels))))
        found = find_board(reduced(image, factor), self._board, self._detector, "none")
        if len(found):
            found = replace(found, pixels=(found.pixels + 0.5) * factor - 0.5)
        else:
            self._pixels = CAREFUL_PX if self._pixels == QUICK_PX else QUICK_PX
        moved, before = motion_px(self._last, found), self._moved_px
        self._last, self._moved_px = found, moved
        return Glance(
            image, found, float(np.maximum(moved, before)), problems_of(image, found, self._board) if len(found) else ()
        )


def motion_px(before: Detection, now: Detection) -> float:
    """How far corners have moved between two frames, rms over an affine motion; NaN where they have few in common.

    The noise of single corners, found in a reduced image, is as large as what matters: it is averaged out by fitting
    the six numbers of an affine motion to all of them.
    """
    _, first, second = np.intersect1d(before.ids, now.ids, assume_unique=True, return_indices=True)
    if len(first) < FEWEST_IN_COMMON:
        return float("nan")
    at = before.pixels[first]
    moved = _affine(at, now.pixels[second] - at)
    return float(np.sqrt((moved**2).sum(axis=1).mean()))


def _affine(at: Pixels, shifts: Pixels) -> Floats:
    places = np.column_stack([at - at.mean(axis=0), np.ones(len(at))])
    return np.asarray(places @ np.linalg.lstsq(places, shifts, rcond=None)[0])
