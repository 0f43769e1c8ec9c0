"""Which place of the board each pixel looks at: exactly, at the nodes of a grid over the image."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import RectBivariateSpline

from opencsp_calib.arrays import Floats, Mask, Points
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.errors import InputError
from opencsp_calib.pose import Pose

__all__ = ["Nodes", "look_up", "place_on_board"]

STEPS_PX = (8, 4, 2, 1)
EXACT_PX = 5e-5  # how far off cubic interpolation between nodes may be
REACH = 2.0  # squares beyond the outermost corners that are to be exact: the outer squares, and a margin
PADDING = 4  # squares beyond the outermost corners that are bent too; the rest of its plane stays flat
CONVERGED_M = 1e-12
MAX_ITERATIONS = 100


@dataclass(frozen=True, eq=False)
class Nodes:
    """Places on the board that a grid of pixels looks at.

    Parameters
    ----------
    step_px, first_px : int
        From node to node, in x and in y; the first node's x, which is its y too.
    x, y : (rows, columns) m
        In the frame of the board as it is drawn, before it was bent; NaN where the board's plane is not before it.
    """

    step_px: int
    first_px: int
    x: Floats
    y: Floats


def look_up(camera: Camera, board: Board, pose: Pose, border_px: int) -> Nodes:
    """Where the rays of pixels meet a board, flat or shaped, densely enough for cubic interpolation to be exact.

    Parameters
    ----------
    camera : Camera
    board : Board
        Between its corners it is as smooth as bicubic splines are; its bend goes on beyond them for a few squares.
    pose : Pose
        Board to camera.
    border_px : int
        How far beyond the image places are asked for.
    """
    for step in STEPS_PX:
        nodes = _nodes(camera, board, pose, border_px, step)
        if step == STEPS_PX[-1] or _interpolation_error(nodes, board) < EXACT_PX:
            break
    return nodes


def _nodes(camera: Camera, board: Board, pose: Pose, border_px: int, step: int) -> Nodes:
    first = -border_px - 2 * step
    width, height = camera.image_size
    x = np.arange(first, width + border_px + 3 * step, step, dtype=np.float64)
    y = np.arange(first, height + border_px + 3 * step, step, dtype=np.float64)
    pixels = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    rays = camera.unproject(pixels) @ pose.matrix
    places = place_on_board(board, pose.inverse().translation, rays).reshape(len(y), len(x), 2)
    return Nodes(step, first, np.ascontiguousarray(places[..., 0]), np.ascontiguousarray(places[..., 1]))


def _interpolation_error(nodes: Nodes, board: Board) -> float:
    """How far off interpolation is on the board, pixels: an eighth of what leaving out every other node would do."""
    places: Floats = np.stack([nodes.x, nodes.y], axis=-1)
    with np.errstate(all="ignore"):
        by_x, by_y = (np.gradient(places, nodes.step_px, axis=axis) for axis in (1, 0))
        by_pixel = np.stack([by_x, by_y], axis=-1)
        worst = 0.0
        for axis in (0, 1):
            p = np.moveaxis(places, axis, 0)
            missed = p[3:-3] - (9.0 * (p[2:-4] + p[4:-2]) - p[:-6] - p[6:]) / 16.0
            at, slope = p[3:-3], np.moveaxis(by_pixel, axis, 0)[3:-3]
            known = _near(board, at, REACH) & np.isfinite(missed).all(axis=-1) & (np.abs(np.linalg.det(slope)) > 0)
            if known.any():
                pixels = np.linalg.solve(slope[known], missed[known][:, :, None])
                worst = max(worst, float(np.abs(pixels).max()) / 8.0)
    return worst


def _near(board: Board, places: Floats, squares: float) -> Mask:
    """Which of the places (..., 2) are at most so many squares beyond the outermost corners."""
    last = (np.array(board.grid) - 1.0 + squares) * board.spacing_m
    with np.errstate(invalid="ignore"):
        return np.asarray(((places > -squares * board.spacing_m) & (places < last)).all(axis=-1), dtype=np.bool_)


def place_on_board(board: Board, eye: Floats, rays: Points) -> Floats:
    """(N, 2) m: where on the drawing rays from the eye meet the board.

    Parameters
    ----------
    board : Board
    eye : (3,) m
        In the board's frame.
    rays : (N, 3)
        In the board's frame.

    Raises
    ------
    InputError
        If the board is bent so sharply that it would hide parts of itself.
    """
    displacement = _displacement(board)
    with np.errstate(all="ignore"):
        slope = rays[:, :2] / rays[:, 2:]
        before = (-eye[2] / rays[:, 2]) > 0
        places: Floats = np.where(before[:, None], eye[:2] - eye[2] * slope, np.nan)
    if displacement is None:
        return places
    near = _near(board, places, PADDING)
    place, slope = places[near], slope[near]
    # the surface is nearly flat: its height where the ray was seen to meet it last gives where it meets it next
    for _ in range(MAX_ITERATIONS):
        moved = displacement(place)
        following = eye[:2] + (moved[:, 2:] - eye[2]) * slope - moved[:, :2]
        change = np.abs(following - place).max(initial=0.0)
        place = following
        if change < CONVERGED_M:
            places[near] = place
            return places
    raise InputError(f"a {board.kind} bent so sharply cannot be rendered from there")


def _displacement(board: Board) -> Callable[[Floats], Points] | None:
    """How far places (N, 2) of the drawing are from where a flat board has them, (N, 3) m; None if nowhere."""
    columns, rows = board.grid
    moved = (board.points - board.nominal_points).reshape(rows, columns, 3)
    if not moved.any():
        return None
    x, y = np.arange(-PADDING, columns + PADDING), np.arange(-PADDING, rows + PADDING)
    # beyond the corners the board's large bend goes on, and what each row and column differs from that
    bend = _quadratic(moved, x, y)
    inner = slice(PADDING, -PADDING)
    rest = np.pad(moved - bend[inner, inner], ((PADDING, PADDING), (PADDING, PADDING), (0, 0)), mode="edge")
    shape = bend + rest
    splines = [RectBivariateSpline(y * board.spacing_m, x * board.spacing_m, shape[..., k]) for k in range(3)]
    return lambda places: np.stack([spline.ev(places[:, 1], places[:, 0]) for spline in splines], axis=1)


def _quadratic(moved: Floats, x: NDArray[np.int64], y: NDArray[np.int64]) -> Floats:
    """The quadratic surface that fits the corners' displacements (rows, columns, 3) best, on the larger grid."""
    u, v = np.meshgrid(x, y)
    terms = np.stack([np.ones_like(u), u, v, u * u, u * v, v * v], axis=-1).astype(np.float64)
    inner = slice(PADDING, -PADDING)
    found = np.linalg.lstsq(terms[inner, inner].reshape(-1, 6), moved.reshape(-1, 3), rcond=None)[0]
    return np.asarray(terms @ found, dtype=np.float64)
