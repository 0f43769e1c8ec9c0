"""How good one photograph of a board is, and what to do better: blur, light, reflections, size, place.

The noise-limited error of a corner grows with the root of the edge width and falls with contrast and window. Most
limits are where one of these alone costs a factor of two against a good photograph: edge width 0.65 px, contrast 0.6,
window 14 px.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from opencsp_calib.board import Board, CharucoBoard
from opencsp_calib.detection import Detection, Problem
from opencsp_calib.image import Image
from opencsp_calib.photograph.blur import Blur, measured_blur
from opencsp_calib.photograph.light import Light, measured_light, square_heights

__all__ = ["PhotographQuality", "measured", "problems_of"]

MOST_EDGE_WIDTH_PX = 2.6
LEAST_CONTRAST = 0.3
LEAST_SQUARE_PX = 10.0  # the window shrinks with the square: a quarter of the pixels of a large one are left
LEAST_SQUARE_IN_WIDTHS = 6.0  # below, the blur of the next edge reaches into the middle
MOST_MOTION_PX = 3.0  # spreads light by 0.87 px rms, more than a sharp lens does: it has become the larger blur
LEAST_ELONGATION = 1.3  # below, it may as well be the lens
MOST_CLIPPED = 0.05  # of the white; clipping narrows dark squares, and the fit cannot know by how much
MOST_GLARE = 0.01  # of the dark squares
LEAST_EVENNESS = 0.4  # vignetting and a lamp to one side leave more
LEAST_STEEPNESS = 0.6  # of the next white square's level; less has an edge, which crosses squares between
BORDER_IN_SQUARES = 0.5  # nearer to the border, the window of a corner is cut
MOST_REJECTED = 0.1


@dataclass(frozen=True)
class PhotographQuality:
    """What was measured at the board in one photograph.

    Parameters
    ----------
    edge_width_px : float, optional
        Standard deviation of the blur, median over the corners; None where the corners were not fitted.
    blur : Blur, optional
        Its ellipse; of plain checkerboards.
    light : Light, optional
    square_px : float
        Smaller height of a square, median over the board.
    at_border : int
        Corners within half a square of the image's border.
    rejected : float
        Part of the corners that the fit rejected.
    rejected_for : str
        The most frequent reason.
    """

    edge_width_px: float | None
    blur: Blur | None
    light: Light | None
    square_px: float
    at_border: int
    rejected: float
    rejected_for: str


def problems_of(image: Image, detection: Detection, board: Board) -> tuple[Problem, ...]:
    """What is wrong with a photograph, and what to do better; nothing where too little of the board was found."""
    quality = measured(image, detection, board)
    if quality is None:
        return ()
    return (*_blur_problems(quality), *_light_problems(quality.light), *_place_problems(quality, detection))


def measured(image: Image, detection: Detection, board: Board) -> PhotographQuality | None:
    """The quality of a photograph.

    Parameters
    ----------
    image : Image
    detection : Detection
        The corners, as refined.
    board : Board

    Returns
    -------
    PhotographQuality or None
        None where no square was found with its four corners.
    """
    columns, rows = board.grid
    trusted = np.full((rows * columns, 2), np.nan)
    trusted[detection.ids] = detection.pixels
    seen = trusted.copy()
    for corner in detection.rejected:
        seen[corner.id] = corner.pixel
    heights = square_heights(seen.reshape(rows, columns, 2))
    if len(heights) == 0:
        return None
    square_px = float(np.median(heights))
    reasons = Counter(corner.reason for corner in detection.rejected).most_common(1)
    return PhotographQuality(
        edge_width_px=None if detection.edge_width_px is None else float(np.median(detection.edge_width_px)),
        blur=None if isinstance(board, CharucoBoard) else measured_blur(image, trusted.reshape(rows, columns, 2)),
        light=measured_light(image, seen.reshape(rows, columns, 2), board),
        square_px=square_px,
        at_border=_near_border(detection, image, BORDER_IN_SQUARES * square_px),
        rejected=len(detection.rejected) / (len(detection) + len(detection.rejected)),
        rejected_for=reasons[0][0] if reasons else "",
    )


def _near_border(detection: Detection, image: Image, distance_px: float) -> int:
    to_border = np.minimum(detection.pixels, np.array(image.size) - 1 - detection.pixels).min(axis=1)
    return int((to_border < distance_px).sum())


def _blur_problems(quality: PhotographQuality) -> Iterator[Problem]:
    blur, width = quality.blur, quality.edge_width_px
    if width is None and blur is not None:
        width = (blur.major_px * blur.minor_px) ** 0.5
    if blur and blur.motion_px > MOST_MOTION_PX and blur.major_px > LEAST_ELONGATION * blur.minor_px:
        message = (
            f"moved by about {blur.motion_px:.1f} px while the shutter was open, in the direction "
            f"{_in_words(blur.direction_deg)}: expose shorter, or hold the board and the camera still"
        )
        yield Problem("motion-blur", message)
    elif width and width > MOST_EDGE_WIDTH_PX:
        message = (
            f"out of focus: edges are {width:.1f} px wide (one sigma), sharp ones 0.7: focus, or close the aperture"
        )
        yield Problem("out-of-focus", message)
    if quality.square_px < max(LEAST_SQUARE_PX, LEAST_SQUARE_IN_WIDTHS * (width or 0)):
        message = f"the squares are only {quality.square_px:.0f} px high: go nearer, or use a board with larger squares"
        yield Problem("squares-too-small", message)


def _light_problems(light: Light | None) -> Iterator[Problem]:
    if light is None:
        return
    if light.contrast < LEAST_CONTRAST:
        message = f"white is only {light.contrast:.0%} of the range brighter than black: expose longer, or add light"
        yield Problem("low-contrast", message)
    if light.clipped > MOST_CLIPPED:
        message = f"{light.clipped:.0%} of the white on the board is saturated: expose shorter"
        yield Problem("clipped", message)
    if light.glare > MOST_GLARE and light.glare_at:
        x, y = light.glare_at
        message = f"a reflection lights up {light.glare:.0%} of the dark squares, near pixel ({x:.0f}, {y:.0f})"
        yield Problem("glare", f"{message}: move the lamp or tilt the board")
    if light.steepest < LEAST_STEEPNESS or light.evenness < LEAST_EVENNESS:
        message = (
            f"a shadow or uneven light: the darkest white squares have {light.evenness:.0%} of the brightest's level"
        )
        yield Problem("shadow", f"{message}: light the board evenly")


def _place_problems(quality: PhotographQuality, detection: Detection) -> Iterator[Problem]:
    if quality.at_border:
        message = f"within half a square of the image's border: {quality.at_border} of {len(detection)} corners"
        yield Problem("at-border", f"{message}: move the board inwards a little")
    if quality.rejected > MOST_REJECTED:
        message = f"{quality.rejected:.0%} of the corners found are of no use, most often: {quality.rejected_for}"
        yield Problem("corners-rejected", message)


def _in_words(direction_deg: float) -> str:
    names = ("left to right", "upper left to lower right", "top to bottom", "upper right to lower left")
    return names[int((direction_deg + 22.5) // 45) % 4]
