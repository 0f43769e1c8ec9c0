"""Which place of the board each pixel looks at: exactly, at the nodes of a grid over the image."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import RectBivariateSpline

from opencsp_calib.arrays import Floats, Points
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.pose import Pose

__all__ = ["STEP_PX", "Nodes", "look_up", "place_on_board"]

STEP_PX = 8  # cubic interpolation between such nodes is exact to 1e-6 px for f = 2700 px
CONVERGED_M = 1e-13
MAX_STEPS = 100


@dataclass(frozen=True, eq=False)
class Nodes:
    """Places on the board that a grid of pixels looks at.

    Parameters
    ----------
    first_px : int
        The x and y of the first node; the others follow every `STEP_PX`.
    x, y : (rows, columns) m
        In the frame of the board as it is drawn, before it was bent; NaN where the board's plane is not before it.
    """

    first_px: int
    x: Floats
    y: Floats


def look_up(camera: Camera, board: Board, pose: Pose, border_px: int) -> Nodes:
    """Where the rays of pixels meet a board, flat or shaped.

    Parameters
    ----------
    camera : Camera
    board : Board
        Between its corners it is as smooth as bicubic splines are; beyond them it goes on straight.
    pose : Pose
        Board to camera.
    border_px : int
        How far beyond the image places are asked for.
    """
    first = -border_px - 2 * STEP_PX
    width, height = camera.image_size
    x = np.arange(first, width + border_px + 3 * STEP_PX, STEP_PX, dtype=np.float64)
    y = np.arange(first, height + border_px + 3 * STEP_PX, STEP_PX, dtype=np.float64)
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    rays = camera.unproject(pixels) @ pose.matrix
    places = place_on_board(board, pose.inverse().translation, rays).reshape(len(y), len(x), 2)
    return Nodes(first, np.ascontiguousarray(places[..., 0]), np.ascontiguousarray(places[..., 1]))


def place_on_board(board: Board, eye: Floats, rays: Points) -> Floats:
    """(N, 2) m: where on the drawing rays from the eye meet the board.

    Parameters
    ----------
    board : Board
    eye : (3,) m
        In the board's frame.
    rays : (N, 3)
        In the board's frame.
    """
    displacement = _displacement(board)
    with np.errstate(all="ignore"):
        slope = rays[:, :2] / rays[:, 2:]
        before = (-eye[2] / rays[:, 2]) > 0
        places = np.where(before[:, None], eye[:2] - eye[2] * slope, np.nan)
        if displacement is None:
            return places
        # the surface is nearly flat: its height where the ray was seen to meet it last gives where it meets it next
        for _ in range(MAX_STEPS):
            moved = displacement(places)
            following = eye[:2] + (moved[:, 2:] - eye[2]) * slope - moved[:, :2]
            change = np.abs(following - places)
            places = following
            if not (change > CONVERGED_M).any():
                break
    return places


def _displacement(board: Board) -> Callable[[Floats], Points] | None:
    """How far places (N, 2) of the drawing are from where a flat board has them, (N, 3) m; None if nowhere."""
    columns, rows = board.grid
    moved = board.points - board.nominal_points
    if not moved.any():
        return None
    x, y = np.arange(columns) * board.spacing_m, np.arange(rows) * board.spacing_m
    degrees = {"kx": min(3, rows - 1), "ky": min(3, columns - 1)}
    splines = [RectBivariateSpline(y, x, moved[:, k].reshape(rows, columns), **degrees) for k in range(3)]
    last = np.array([x[-1], y[-1]])

    def displacement(places: Floats) -> Points:
        inside = np.clip(places, 0.0, last)
        beyond = places - inside
        values = [
            spline.ev(inside[:, 1], inside[:, 0])
            + beyond[:, 0] * spline.ev(inside[:, 1], inside[:, 0], dy=1)
            + beyond[:, 1] * spline.ev(inside[:, 1], inside[:, 0], dx=1)
            for spline in splines
        ]
        return np.stack(values, axis=1)

    return displacement
