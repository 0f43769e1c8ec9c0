"""The worlds in which solvers are checked: small, with known answers, every lens model well determined."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Detection, Observations
from opencsp_calib.interfaces import Solver
from opencsp_calib.pose import Pose
from opencsp_calib.synthetic import observe, random_poses

__all__ = ["BOARD", "VIEWS", "World", "camera_of", "edited", "main_model", "world"]

VIEWS = 16
BOARD = Checkerboard(12, 9, 0.03)
IMAGE_SIZE = (1280, 960)
RADIAL_AND_TANGENTIAL, MORE_RADIAL = (-0.21, 0.09, 0.0011, -0.0007), (-0.021, 0.05, 0.02, 0.004)
COEFFICIENTS = (*RADIAL_AND_TANGENTIAL, *MORE_RADIAL, 0.0012, -0.0006, -0.0009, 0.0004, 0.011, -0.007)
FISHEYE = (0.021, -0.006, 0.0031, -0.0012)


@dataclass(frozen=True, eq=False)
class World:
    """A camera, a board as it truly is, where it was, and what was seen of it."""

    camera: Camera
    board: Board
    poses: tuple[Pose, ...]
    observations: Observations

    def seen_as(self, observations: Observations) -> "World":
        """The same truth, otherwise observed."""
        return replace(self, observations=observations)


def main_model(solver: Solver) -> str:
    """The lens model that checks use which are not about lens models."""
    return "opencv4" if "opencv4" in solver.models else sorted(solver.models)[0]


def camera_of(model: str) -> Camera:
    """A wide camera with a principal point off the middle and pixels not quite square."""
    if model == "opencv_fisheye":
        params = [520.3, 520.8, 652.4, 468.9, *FISHEYE]
    else:
        count = 0 if model == "pinhole" else int(model.removeprefix("opencv"))
        params = [1010.3, 1011.3, 652.4, 468.9, *COEFFICIENTS[:count]]
    return Camera("truth", model, np.array(params), IMAGE_SIZE)


def world(
    model: str,
    *,
    noise_px: float = 0.0,
    truth: Board = BOARD,
    given: Board | None = None,
    views: int = VIEWS,
    tilt_deg: tuple[float, float] = (20.0, 50.0),
) -> World:
    """A world with a camera of that lens model.

    Parameters
    ----------
    model : str
    noise_px : float
    truth : Board
        `BOARD` as it truly is.
    given : Board, optional
        What solvers are told it is; by default the truth.
    views : int
    tilt_deg : (float, float)
    """
    camera = camera_of(model)
    poses = _poses(model, views, tilt_deg)
    seen = observe(camera, truth, poses, noise_px=noise_px, rng=11, nominal=given or truth)
    return World(camera, truth, poses, seen)


@cache  # finding them takes longer than solving, and most checks want the same; no solver ever gets to see them
def _poses(model: str, views: int, tilt_deg: tuple[float, float]) -> tuple[Pose, ...]:
    return random_poses(BOARD, camera_of(model), views, 7, tilt_deg=tilt_deg, fill=(0.5, 0.95))


def edited(observations: Observations, change: Callable[[int, Detection], Detection]) -> Observations:
    """The same with each used view's detection replaced by what `change` makes of its number and it."""
    numbers = {view.image: number for number, view in enumerate(observations.used)}
    views = [
        replace(view, detection=change(numbers[view.image], view.detection)) if view.image in numbers else view
        for view in observations.views
    ]
    return replace(observations, views=tuple(views))
