"""Whether to solve for the board's shape, decided from the data; and whether pixels must be taken as square then.

What speaks for the shape is in `opencsp_calib.shape_evidence`; here is who asks, and what is done about the answer.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.calibration import Calibration
from opencsp_calib.detection import Observations, Problem
from opencsp_calib.errors import CalibError, CalibrationFailedError
from opencsp_calib.flatness import not_flat
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.rotations import rotation_matrices
from opencsp_calib.shape_evidence import evidence_of
from opencsp_calib.uncertainty import UNKNOWN, with_uncertainty

__all__ = [
    "TURNED_DEG",
    "Run",
    "decide",
    "obstacle_to_shape",
    "roll_spread_deg",
    "solve_with_aspect",
]

Run: TypeAlias = Callable[[Observations, SolveOptions], Calibration]

MIN_VIEWS = 8
"""Each half then has four views: eight numbers for the three coordinates of a corner and its share of the rest."""
MIN_DIRECTIONS_DEG = 20.0
"""Between two lines of sight, in the board's frame: with less, heights are known three times worse than places."""
TURNED_DEG = 45.0


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
    obstacle = obstacle_to_shape(observations, given)
    if obstacle:
        return given.with_problems(Problem("board-as-given", f"the board was taken as it is given: {obstacle}"))
    shape = replace(options, board_shape="free")
    assumed = () if aspect_given else _assumed_square(given.cam_from_board)
    shape = replace(shape, pixel_aspect=1.0) if assumed else shape
    try:
        evidence = evidence_of(given, shape)
        solved = _shape_solved(observations, replace(shape, guess=given.camera), run) if evidence.for_shape else given
    except (CalibError, np.linalg.LinAlgError) as error:
        message = f"the board was taken as it is given, because its shape could not be solved for: {error}"
        return given.with_problems(Problem("board-as-given", message))
    if evidence.for_shape:
        solved = replace(solved, options=shape)  # nobody asked for the guess, and the result does not need it
        said = Problem("board-shape-solved", f"the board's shape was solved for: {evidence}")
        return solved.with_problems(said, *assumed, *not_flat(solved))
    return given.with_problems(Problem("board-as-given", f"the board was taken as it is given: {evidence}"))


def solve_with_aspect(
    observations: Observations, options: SolveOptions, run: Run, *, aspect_given: bool = False
) -> Calibration:
    """Solve as asked; but where the board's shape is solved for and no view is turned, with square pixels, saying so.

    Where all views hold the board the same way up, fy/fx and the ratio of the board's pitches cannot be told apart.
    Nearly every sensor has square pixels; few boards have the pitch they should have. A smooth warp has a ratio of
    pitches as well.

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
    if options.board_shape != "flat" and not aspect_given:
        camera = initial_camera(observations, "pinhole", options.guess)
        assumed = _assumed_square(initial_poses(camera, observations))
        options = replace(options, pixel_aspect=1.0) if assumed else options
    calibration = run(observations, options).with_problems(*assumed)
    return calibration if options.board_shape == "flat" else calibration.with_problems(*not_flat(calibration))


def roll_spread_deg(cam_from_board: tuple[Pose, ...]) -> float:
    """How far the two views differ whose boards are turned most differently in the image, 0 to 90 degrees.

    A board that is upside down counts as not turned: its columns run along the same lines.
    """
    turns = rotation_matrices(np.array([pose.rotation for pose in cam_from_board]))
    rolls = np.arctan2(turns[:, 1, 0], turns[:, 0, 0])
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


def obstacle_to_shape(observations: Observations, given: Calibration) -> str:
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
    turns = rotation_matrices(np.array([pose.rotation for pose in given.cam_from_board]))
    shifts = np.array([pose.translation for pose in given.cam_from_board])
    sights: Floats = -(shifts[:, None] @ turns)[:, 0] - middle
    sights = sights / np.linalg.norm(sights, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip(sights @ sights.T, -1.0, 1.0).min())))


def _shape_solved(observations: Observations, options: SolveOptions, run: Run) -> Calibration:
    solved = with_uncertainty(run(observations, options))
    for problem in solved.problems:
        if problem.code in UNKNOWN:
            raise CalibrationFailedError(problem.message)
    return solved
