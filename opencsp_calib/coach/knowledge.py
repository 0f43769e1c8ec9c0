"""What the photographs taken so far tell: a camera, how uncertain it is, what the set lacks, where to hold the board.

Made anew after every photograph, in a second or so, by the same solver and the same honest uncertainty as the
calibration that follows; before there are enough views, from a rough camera.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from opencsp_calib.arrays import Matrix
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.coach.lacking import Lack, lacks
from opencsp_calib.coach.next_view import SHAPED, SIGMA_PX, Candidates, NextView, candidates, choose, detection_from
from opencsp_calib.counted import counted
from opencsp_calib.detection import Detection, Observations, View
from opencsp_calib.errors import CalibError
from opencsp_calib.information import GOAL_PX, ProjectionGoal, view_information
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.models import lens_model
from opencsp_calib.pipeline import DEFAULT_MODEL, solve
from opencsp_calib.pose import Pose
from opencsp_calib.projection_sigma import sigma_map

__all__ = ["Knowledge", "learn"]

ENOUGH_TO_SOLVE = 4
SAME_CAMERA = 0.02  # of the focal length
USUAL_FOCAL = 1.5  # image widths: what is taken before anything is known


@dataclass(frozen=True, eq=False)
class Knowledge:
    """What is known after some photographs.

    Parameters
    ----------
    board : Board
    camera : Camera
        As solved; rough before that is possible.
    calibration : Calibration, optional
        None before there are enough views, or where they could not be solved: `why_not` says why.
    views : tuple of View
        The used ones.
    poses : tuple of Pose
        Of the board in these.
    sigma_px : float
        Honest uncertainty of projections at the working range, rms over the image; NaN where not known.
    goal_px : float
        That it is to reach.
    lacks : tuple of Lack
        What the set still needs.
    next_view : NextView, optional
        Where to hold the board next.
    possible : Candidates
        That it was chosen from.
    goal, information
        For what a further view would be worth: see `gain_of`.
    glimpsed : int
        Views counted by `having_seen`.
    """

    board: Board
    camera: Camera
    calibration: Calibration | None = field(repr=False)
    why_not: str
    views: tuple[View, ...] = field(repr=False)
    poses: tuple[Pose, ...] = field(repr=False)
    sigma_px: float
    goal_px: float
    lacks: tuple[Lack, ...]
    next_view: NextView | None
    possible: Candidates = field(repr=False)
    goal: ProjectionGoal = field(repr=False)
    information: Matrix = field(repr=False)
    glimpsed: int = 0

    @property
    def done(self) -> bool:
        """Whether the uncertainty has reached its goal, and nothing is lacking."""
        return self.sigma_px <= self.goal_px and not self.lacks

    @property
    def progress(self) -> float:
        """From 0 to 1: which part of the information that the goal needs is there, as uncertainty tells it."""
        if not self.sigma_px > 0:
            return 0.0
        return float(min(1.0, (self.goal_px / self.sigma_px) ** 2)) * (0.99 if self.lacks else 1.0)

    def pose_of(self, detection: Detection) -> Pose | None:
        """Where the board is, roughly; None where its corners are too few to tell."""
        try:
            seen = Observations(self.board, self.camera.image_size, (View("", detection, "used"),))
            return initial_poses(self.camera, seen)[0] if len(detection) >= 4 else None
        except (CalibError, np.linalg.LinAlgError):
            return None

    def gain_of(self, pose: Pose) -> float:
        """Part of the expected variance of projections that a view like this would take away."""
        return float(self.goal.gains(self.information, self._told_by(pose)[None])[0])

    def having_seen(self, pose: Pose) -> "Knowledge":
        """With a view like this counted, as long as it has not been learnt from."""
        return replace(self, information=self.information + self._told_by(pose), glimpsed=self.glimpsed + 1)

    def _told_by(self, pose: Pose) -> Matrix:
        seen = detection_from(self.camera, self.board, pose)
        return np.asarray(
            view_information(self.camera, self.board, [seen], [pose], options=SHAPED, sigma_px=SIGMA_PX)[0]
        )

    def adds(self, gain: float) -> bool:
        """Whether a view of that gain is worth its photograph: half of what an average view has brought."""
        worth = 0.5 / (len(self.views) + self.glimpsed + 1)
        return gain >= (min(worth, 0.5 * self.next_view.gain) if self.next_view else worth)


def learn(
    board: Board,
    image_size: tuple[int, int],
    views: Sequence[View] = (),
    *,
    range_m: float | None = None,
    goal_px: float = GOAL_PX,
    before: Knowledge | None = None,
) -> Knowledge:
    """What these views tell.

    Parameters
    ----------
    board : Board
    image_size : (int, int)
    views : sequence of View
        Those that are not used, or of another image size, count for nothing.
    range_m : float, optional
        At which the camera will work; None for infinity.
    goal_px : float
        The uncertainty of projections to reach.
    before : Knowledge, optional
        From fewer views of the same: what it has found out is not found out again.
    """
    observations = Observations(board, image_size, tuple(view for view in views if view.status == "used"))
    calibration, why_not = _solved(observations)
    if calibration:
        camera, poses = calibration.camera, calibration.cam_from_board
        sigma = sigma_map(calibration, range_m).rms_px if np.isfinite(calibration.covariance).all() else float("nan")
    else:
        camera, sigma = _rough_camera(observations), float("nan")
        poses = initial_poses(camera, observations) if observations.used else ()
    goal = ProjectionGoal.of(camera, board, range_m, options=SHAPED, grid=(16, 12))
    told = view_information(camera, board, observations.detections, poses, options=SHAPED, sigma_px=SIGMA_PX)
    known = told.sum(axis=0)
    missing = lacks(observations, poses)
    possible = _still_possible(camera, before) or candidates(camera, board, rng=len(poses))
    suggested = choose(
        possible, camera, board, goal, known, lambda pose: sum(lack.helped_by(camera, board, pose) for lack in missing)
    )
    return Knowledge(
        board=board,
        camera=camera,
        calibration=calibration,
        why_not=why_not,
        views=observations.used,
        poses=tuple(poses),
        sigma_px=sigma,
        goal_px=goal_px,
        lacks=missing,
        next_view=suggested,
        possible=possible,
        goal=goal,
        information=known,
    )


def _still_possible(camera: Camera, before: Knowledge | None) -> Candidates | None:
    """The candidates there were, where the camera has not changed so much that they would look different."""
    if before is None:
        return None
    moved = np.abs(camera.params[:4] - before.camera.params[:4]).max()
    return before.possible if moved < SAME_CAMERA * camera.params[0] else None


def _solved(observations: Observations) -> tuple[Calibration | None, str]:
    count = len(observations.used)
    if count < ENOUGH_TO_SOLVE:
        return None, f"{counted(ENOUGH_TO_SOLVE - count, 'more view')} until the camera can be told"
    try:
        return solve(observations), ""
    except (CalibError, np.linalg.LinAlgError) as error:
        return None, f"the views do not tell the camera yet: {error}"


def _rough_camera(observations: Observations) -> Camera:
    width, height = observations.image_size
    if observations.used:
        found = initial_camera(observations, DEFAULT_MODEL)
        if 0.3 < found.params[0] / max(width, height) < 15.0:  # head-on views leave it open
            return found
    focal = USUAL_FOCAL * max(width, height)
    distortion = np.zeros(len(lens_model(DEFAULT_MODEL).distortion_names))
    params = np.concatenate([[focal, focal, (width - 1) / 2, (height - 1) / 2], distortion])
    return Camera("rough", DEFAULT_MODEL, params, observations.image_size)
