"""Where to hold the board, in words and drawn with characters."""

from collections.abc import Mapping

import numpy as np

from opencsp_calib.arrays import Pixels
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.coach.lacking import REGIONS
from opencsp_calib.pose import Pose
from opencsp_calib.quality import held, range_of
from opencsp_calib.synthetic import outline

__all__ = ["described", "sketch", "tilted_side"]

STEPS = 200  # points drawn along an outline


def described(camera: Camera, board: Board, pose: Pose) -> str:
    """Such as ``vertical, in the middle of the image, 1.80 m away, its right side turned away by 35 degrees``."""
    middle = camera.project(pose.transform(board.points.mean(axis=0)[None]))[0]
    column, row = np.digitize(np.nan_to_num(middle / np.array(camera.image_size), nan=0.5), [0.42, 0.58])
    region = REGIONS[int(column), int(row)]
    return (
        f"{held(board, pose)}, in the {region}{'' if region == 'middle' else ' part'} of the image, "
        f"{range_of(board, pose):.2f} m away, its {tilted_side(board, pose)} turned away by {pose.tilt_deg:.0f} degrees"
    )


def tilted_side(board: Board, pose: Pose) -> str:
    """The side of the board, as the camera sees it, that is farthest away: ``right side``, ``upper left corner``."""
    rim = pose.transform(outline(board))
    rim = rim - rim.mean(axis=0)
    slope = np.linalg.lstsq(rim[:, :2], rim[:, 2], rcond=None)[0]
    length = float(np.linalg.norm(slope))
    if length < 1e-6:
        return "whole"
    across, down = (0 if abs(part) < 0.38 * length else int(np.sign(part)) for part in slope)  # sin 22.5 degrees
    name = REGIONS[across + 1, down + 1]
    return f"{name} corner" if across and down else f"{name} side"


def sketch(outlines: Mapping[str, Pixels], image_size: tuple[int, int], columns: int = 48) -> list[str]:
    """The image's frame as lines of text, with outlines (N, 2) px drawn in their characters, later ones on top."""
    width, height = image_size
    rows = max(4, round(columns * height / width / 2))  # a character is about twice as high as wide
    canvas = [[" "] * columns for _ in range(rows)]
    for character, corners in outlines.items():
        for x, y in _along(corners):
            column, row = int((x + 0.5) / width * columns), int((y + 0.5) / height * rows)
            if 0 <= column < columns and 0 <= row < rows:
                canvas[row][column] = character
    edge = "+" + "-" * columns + "+"
    return [edge, *("|" + "".join(line) + "|" for line in canvas), edge]


def _along(corners: Pixels) -> Pixels:
    """Points along a closed line."""
    known = corners[np.isfinite(corners).all(axis=1)]
    if len(known) < 2:
        return known
    closed = np.vstack([known, known[:1]])
    at = np.linspace(0, len(known), STEPS)
    return np.column_stack([np.interp(at, np.arange(len(closed)), closed[:, axis]) for axis in (0, 1)])
