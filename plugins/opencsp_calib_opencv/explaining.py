"""Why no board was found, or not all of it, in words that say what to do."""

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.detection import Detection
from opencsp_calib.image import Image
from opencsp_calib_opencv.grid import count, known

__all__ = ["emptiness", "incomplete", "not_placed", "two_boards"]

SAMPLE_STEP = 7  # pixels: a hundredth of the image tells whether there is anything in it
FLAT = 0.02  # of the image's range, from the 1st to the 99th percentile
FEWEST_CORNERS = 9
LEAST_FULL = 0.5  # of a line of corners


def emptiness(image: Image) -> str | None:
    """What is wrong with an image that shows nothing at all; None where it shows something."""
    step = max(1, min(SAMPLE_STEP, min(image.size) // 8))
    darkest, brightest = np.percentile(image.pixels[::step, ::step], [1, 99]) / image.white
    if brightest - darkest > FLAT:
        return None
    if brightest < FLAT:
        return "the image is black; open the aperture, expose longer or light the board"
    if darkest > 1 - FLAT:
        return "the image is saturated; expose shorter or close the aperture"
    return "the image is blank: all of it is one grey"


def incomplete(found: int, board: Board) -> str:
    """Why there are no more corners than were found; empty where all were."""
    missing = len(board.points) - found
    return f"out of view, covered or too unclear: {missing} of {len(board.points)} corners" if missing else ""


def not_placed(board: Board, grid: Floats | None, whole: bool) -> Detection:
    """Nothing, and what the largest grid of corners that was found means for somebody who looks for the board.

    Parameters
    ----------
    board : Board
    grid : (m, n, 2) px, optional
    whole : bool
        Whether a margin is seen all around it.
    """
    wanted = f"{board.columns}x{board.rows}"
    if grid is None or count(grid) < FEWEST_CORNERS or _size(grid)[0] < 3:
        return Detection.nothing(f"no {wanted} checkerboard was found")
    small, large = _size(grid)
    least, most = sorted(board.grid)
    found = f"{large}x{small}" if board.columns >= board.rows else f"{small}x{large}"
    other = whole or small > least or large > most
    if (small + 1, large + 1) == (least, most):
        of_corners = Checkerboard(board.columns - 1, board.rows - 1, board.spacing_m)
        return Detection.nothing(
            f"the checkerboard found has {found} inner corners, not {wanted}, which counts its squares; "
            f"inner corners are one less each way: write {of_corners.spec}",
            other_board=other,
        )
    if other:
        return Detection.nothing(f"the checkerboard found has {found} inner corners, not {wanted}", other_board=True)
    return Detection.nothing(
        f"only {found} corners in a block were found of {wanted}, and which ones cannot be told; "
        "show the whole board, or all of it one way and its white margin the other"
    )


def _size(grid: Floats) -> tuple[int, int]:
    """The lines of a grid either way, the fewer first; one that is not half full is taken for something else nearby."""
    there = known(grid)
    rows, columns = ((there.mean(axis=along) > LEAST_FULL).sum() for along in (1, 0))
    return int(min(rows, columns)), int(max(rows, columns))


def two_boards(board: Board) -> str:
    """What to do where the board is seen twice."""
    return f"two {board.columns}x{board.rows} checkerboards are in view; cover one, or leave out the image"
