"""Whether to solve for the board's shape, decided from the data; and whether pixels must be taken as square then.

A board taken as flat that is not spoils the camera far beyond what its rms shows. A flat one whose shape is solved
for costs little: sigmas 1.9, 1.5, 1.2 times as large at 10, 20, 50 views. rms and held-out rms always prefer the
shape. Two things tell whether it is worth its price:

*   the odd and the even views, solved apart, agree clearly better over the image with the shape than without it; or
*   solving for the shape moves the camera by more than chance explains. Halves cannot see an error that both of them
    share, and two halves with like poses share most of what a bent board does: of worlds with a board 0.5 mm out of
    flat and noise of 0.1 px they get most wrong, with the camera off by ten sigmas. (An estimate that is right either
    way is held against one that is right only if the board is flat: Hausman 1978.) What chance explains is the
    jackknife sigma of the move itself: how far it changes when each view in turn is left out.

Neither needs the solution with the shape: from the one without it, one Newton step gives it to a hundredth, and where
it would not, the board is so bent that there is nothing to decide.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.calibration import Calibration
from opencsp_calib.comparison import compare
from opencsp_calib.detection import Observations, Problem
from opencsp_calib.errors import CalibError, CalibrationFailedError
from opencsp_calib.flatness import not_flat
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.leaving_out import camera_without_each_view
from opencsp_calib.newton import stepped
from opencsp_calib.normal_equations import normal_equations
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.projection_sigma import camera_sigma_map
from opencsp_calib.resampling import nearby_halves
from opencsp_calib.schur import factorise
from opencsp_calib.uncertainty import jackknife_covariance, with_uncertainty

__all__ = [
    "TURNED_DEG",
    "Evidence",
    "Run",
    "decide",
    "evidence_of",
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
CLEARLY = 1.5  # two halves are one draw of a figure that scatters by about half: less is chance
SIGMAS = 2.0  # a camera that moves by more has, by about 20 to 1, a bias that outweighs what the shape adds to chance


@dataclass(frozen=True)
class Evidence:
    """What speaks for and against the board's shape, all rms over the image after aligning the frames.

    Parameters
    ----------
    given_halves_px, solved_halves_px : float
        How far apart the halves are with the board as given, and with its shape solved for.
    moved_px, sigma_px : float
        How far solving for the shape moves the camera, and how far chance would.
    """

    given_halves_px: float
    solved_halves_px: float
    moved_px: float
    sigma_px: float

    @property
    def by_halves(self) -> bool:
        """Whether the halves agree clearly better with the shape."""
        return CLEARLY * self.solved_halves_px < self.given_halves_px

    @property
    def by_move(self) -> bool:
        """Whether solving for the shape moves the camera by more than chance."""
        return self.moved_px > SIGMAS * self.sigma_px

    @property
    def for_shape(self) -> bool:
        """Whether one of the two speaks for it."""
        return self.by_halves or self.by_move

    def __str__(self) -> str:
        return (
            f"odd and even views differ by {self.given_halves_px:.2g} px over the image with the board as given, by "
            f"{self.solved_halves_px:.2g} px with its shape, and solving for it moves the camera by "
            f"{self.moved_px:.2g} px, chance by {self.sigma_px:.2g} px (all rms)"
        )


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
    sights: Floats = np.array([pose.inverse().translation - middle for pose in given.cam_from_board])
    sights = sights / np.linalg.norm(sights, axis=1, keepdims=True)
    return float(np.degrees(np.arccos(np.clip(sights @ sights.T, -1.0, 1.0).min())))


def _shape_solved(observations: Observations, options: SolveOptions, run: Run) -> Calibration:
    solved = with_uncertainty(run(observations, options))
    if not np.isfinite(solved.covariance).all():
        raise CalibrationFailedError(solved.problems[-1].message)
    return solved


def evidence_of(given: Calibration, shape: SolveOptions) -> Evidence:
    """What one Newton step towards the solution with the board's shape tells.

    Parameters
    ----------
    given : Calibration
        With the board as given.
    shape : SolveOptions
        With which the shape would be solved for.

    Raises
    ------
    numpy.linalg.LinAlgError, CalibrationFailedError
        If the views, or half of them, do not determine the shape.
    """
    camera, aspect = given.camera, shape.pixel_aspect
    if aspect is not None:
        params = camera.params.copy()
        params[1] = aspect * params[0]
        camera = replace(camera, params=params)
    solved = stepped(replace(given, camera=camera, options=shape))
    steps = (camera_without_each_view(factorise(normal_equations(one))) for one in (given, solved))
    by_chance = jackknife_covariance(np.subtract(*steps))
    return Evidence(
        nearby_halves(given).rms_px,
        nearby_halves(solved).rms_px,
        compare(given.camera, solved.camera).rms_px,
        camera_sigma_map(given.camera, by_chance).rms_px,
    )
