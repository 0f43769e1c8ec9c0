"""Whether to solve for the board's shape, decided from the data; and whether pixels must be taken as square then.

A board taken as flat that is not spoils the camera far beyond what its rms shows. A flat one whose shape is solved
for costs little: sigmas 1.9, 1.5, 1.2 times as large at 10, 20, 50 views. rms and held-out rms always prefer the
shape, so the decision is by halves: the odd and the even views are solved apart, with and without the shape, and the
way in which the two cameras agree better over the image is taken.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.calibration import Calibration
from opencsp_calib.compare import compare
from opencsp_calib.detection import Observations, Problem
from opencsp_calib.errors import CalibError
from opencsp_calib.flatness import not_flat
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.resampling import halves

__all__ = ["Run", "decide", "roll_spread_deg", "solve_with_aspect"]

Run: TypeAlias = Callable[[Observations, SolveOptions], Calibration]

MIN_VIEWS = 8
"""Each half then has four views: eight numbers for the three coordinates of a corner and its share of the rest."""
MIN_DIRECTIONS_DEG = 20.0
"""Between two lines of sight, in the board's frame: with less, heights are known three times worse than places."""
TURNED_DEG = 45.0


@dataclass(frozen=True, eq=False)
class _Way:
    """The whole set solved in one way, and how far apart its halves are."""

    whole: Calibration
    halves_rms_px: float


def decide(observations: Observations, options: SolveOptions, run: Run, *, aspect_given: bool = False) -> Calibration:
    """Solve with the board as given, or with its shape, whichever the data support.

    Parameters
    ----------
    observations : Observations
    options : SolveOptions
        All but `board_shape`, which is decided.
    run : callable
        Solves; of a solver that can start from a guess and solve for the board's shape.
    aspect_given : bool
        Whether somebody has chosen `options.pixel_aspect`; otherwise see `solve_with_aspect`.

    Returns
    -------
    Calibration
        A `Problem` says what was decided and why: ``board-as-given`` or ``board-shape-solved``.

    Raises
    ------
    InputError, CalibrationFailedError
        As `run` with the board as given.
    """
    given = run(observations, replace(options, board_shape="flat"))
    obstacle = _obstacle(observations, given)
    if obstacle:
        return given.with_problems(Problem("board-as-given", f"the board was taken as it is given: {obstacle}"))
    shape = replace(options, board_shape="free")
    assumed = () if aspect_given else _assumed_square(given.cam_from_board)
    shape = replace(shape, pixel_aspect=1.0) if assumed else shape
    try:
        solved = _way(observations, shape, run, guess=given)
        plain = _way(observations, replace(options, board_shape="flat"), run, guess=given, whole=given)
    except CalibError as error:
        message = f"the board was taken as it is given, because its shape could not be solved for: {error}"
        return given.with_problems(Problem("board-as-given", message))
    figures = f"{plain.halves_rms_px:.2g} px with the board as given, {solved.halves_rms_px:.2g} px with its shape"
    why = f"odd and even views solved apart differ over the image by {figures} (rms)"
    if solved.halves_rms_px < plain.halves_rms_px:
        said = Problem("board-shape-solved", f"the board's shape was solved for: {why}")
        return solved.whole.with_problems(said, *assumed, *not_flat(solved.whole))
    return given.with_problems(Problem("board-as-given", f"the board was taken as it is given: {why}"))


def solve_with_aspect(
    observations: Observations, options: SolveOptions, run: Run, *, aspect_given: bool = False
) -> Calibration:
    """Solve as asked; but where the shape is free and no view is turned, with square pixels, saying so.

    Where all views hold the board the same way up, fy/fx and the ratio of the board's pitches cannot be told apart.
    Nearly every sensor has square pixels; few boards have the pitch they should have.

    Parameters
    ----------
    observations : Observations
    options : SolveOptions
    run : callable
    aspect_given : bool
        Whether somebody has chosen `options.pixel_aspect`: then it stays.

    Returns
    -------
    Calibration
        With a `Problem` ``square-pixels-assumed`` where they were, and ``board-not-flat`` where a shape was solved for
        that the seed would not allow.
    """
    assumed: tuple[Problem, ...] = ()
    if options.board_shape == "free" and not aspect_given:
        camera = initial_camera(observations, "pinhole", options.guess)
        assumed = _assumed_square(initial_poses(camera, observations))
        options = replace(options, pixel_aspect=1.0) if assumed else options
    calibration = run(observations, options).with_problems(*assumed)
    return calibration if options.board_shape == "flat" else calibration.with_problems(*not_flat(calibration))


def roll_spread_deg(cam_from_board: tuple[Pose, ...]) -> float:
    """How far the two views differ whose boards are turned most differently in the image, 0 to 90 degrees.

    A board that is upside down counts as not turned: its columns run along the same lines.
    """
    rolls = np.array([np.arctan2(pose.matrix[1, 0], pose.matrix[0, 0]) for pose in cam_from_board])
    between = np.abs(np.subtract.outer(rolls, rolls)) % np.pi
    return float(np.degrees(np.minimum(between, np.pi - between).max(initial=0.0)))


def _assumed_square(cam_from_board: tuple[Pose, ...]) -> tuple[Problem, ...]:
    spread = roll_spread_deg(cam_from_board)
    if spread > TURNED_DEG:
        return ()
    message = (
        f"pixels were taken as square: no two views turn the board by more than {spread:.0f} degrees against each "
        "other, so that fx/fy and a difference of the board's spacing in x and y cannot be told apart; take views with "
        "the board turned by 90 degrees, or give the pixel aspect"
    )
    return (Problem("square-pixels-assumed", message),)


def _obstacle(observations: Observations, given: Calibration) -> str:
    """Why the shape cannot, or need not, be solved for; empty if nothing stands in the way."""
    board, views = observations.board, len(given.cam_from_board)
    if not np.array_equal(board.points, board.nominal_points):
        return "its corners are measured"
    if board.symmetric:
        return "it looks the same upside down, so that its corners cannot be told apart"
    if views < MIN_VIEWS:
        return f"its shape cannot be solved for from {views} views; take at least {MIN_VIEWS}"
    widest = _widest_directions_deg(given)
    if widest < MIN_DIRECTIONS_DEG:
        return f"it is seen from hardly different directions ({widest:.0f} degrees apart at most); tilt it more"
    return ""


def _widest_directions_deg(given: Calibration) -> float:
    """The widest angle between two lines of sight to the board's middle, in the board's frame."""
    middle = given.board.points.mean(axis=0)
    sights: Floats = np.array([pose.inverse().translation - middle for pose in given.cam_from_board])
    sights = sights / np.linalg.norm(sights, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip(sights @ sights.T, -1.0, 1.0).min())))


def _way(
    observations: Observations, options: SolveOptions, run: Run, *, guess: Calibration, whole: Calibration | None = None
) -> _Way:
    """The whole set (unless it is solved already), then its halves, which start from the whole: camera and board."""
    if whole is None:
        whole = _warm(observations, options, run, guess)
    first, second = (_warm(half.with_board(whole.board), options, run, whole) for half in halves(observations))
    return _Way(whole, compare(first.camera, second.camera).rms_px)


def _warm(observations: Observations, options: SolveOptions, run: Run, guess: Calibration) -> Calibration:
    """Solved from a guess that is not kept among the options: nobody asked for it, and the result does not need it."""
    found = run(observations, replace(options, guess=guess.camera))
    return replace(found, options=options)
