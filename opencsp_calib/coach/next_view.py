"""Where to hold the board next: of many places that the seed's procedure allows, the one that tells most.

Candidates are tilted by 30 to 45 degrees in all directions, held upright or on the side, and fill half to nearly all of
the image, at its middle, edges and corners. What each would take away of the uncertainty of projections follows from
the normal equations alone (`opencsp_calib.information`), before it is photographed.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Matrix, Pixels
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Detection
from opencsp_calib.errors import InputError
from opencsp_calib.information import ProjectionGoal, view_information
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.synthetic import outline, pose_in_view, turned

__all__ = ["SHAPED", "SIGMA_PX", "Candidates", "NextView", "candidates", "choose", "detection_from"]

COUNT = 96
TILTS_DEG, FILLS = (30.0, 45.0), (0.5, 0.92)
MOST_CORNERS = 120  # of a board, for what a view tells: a coarser lattice tells the same, in proportion
SIGMA_PX = 0.1  # of a corner; only ratios matter, and how weak the prior is
SHAPED = SolveOptions(board_shape="warp")
"""With a board that may be bent: else views of the turned board would seem to tell nothing new."""


@dataclass(frozen=True, eq=False)
class Candidates:
    """Views that could be taken next.

    Parameters
    ----------
    poses : tuple of Pose
    information : (N, M, M)
        What each would tell.
    """

    poses: tuple[Pose, ...] = field(repr=False)
    information: Floats = field(repr=False)


@dataclass(frozen=True, eq=False)
class NextView:
    """Where to hold the board.

    Parameters
    ----------
    pose : Pose
    gain : float
        Part of the expected variance of projections that it would take away.
    outline_px : (40, 2) px
        The board's rim in the image.
    """

    pose: Pose
    gain: float
    outline_px: Pixels = field(repr=False)


def candidates(camera: Camera, board: Board, count: int = COUNT, rng: np.random.Generator | int = 0) -> Candidates:
    """Views as the procedure asks for them, spread over everything it leaves open."""
    rng = np.random.default_rng(rng)
    poses = []
    for index in range(count):
        place = (index % 3 / 2, index // 3 % 3 / 2)
        roll = np.radians(90.0 * (index // 9 % 2) + rng.normal(0.0, 2.0))
        rotation = turned(np.radians(rng.uniform(*TILTS_DEG)), rng.uniform(0.0, 2 * np.pi), roll)
        try:
            poses.append(pose_in_view(board, camera, rotation, rng.uniform(*FILLS), place))
        except InputError:  # the camera cannot see it like that
            continue
    seen = [detection_from(camera, board, pose) for pose in poses]
    told = view_information(camera, board, seen, poses, options=SHAPED, sigma_px=SIGMA_PX)
    return Candidates(tuple(poses), told * (len(board.points) / max(1, len(_lattice(board)))))


def choose(
    possible: Candidates,
    camera: Camera,
    board: Board,
    goal: ProjectionGoal,
    known: Matrix,
    helps: Callable[[Pose], int],
) -> NextView | None:
    """The candidate that tells most, with those preferred that bring what is missing (`helps` counts it)."""
    if not possible.poses:
        return None
    gains = goal.gains(known, possible.information)
    best = int(np.argmax(gains * [1 + helps(pose) for pose in possible.poses]))
    pose = possible.poses[best]
    return NextView(pose, float(gains[best]), camera.project(pose.transform(outline(board))))


def detection_from(camera: Camera, board: Board, pose: Pose) -> Detection:
    """Those of a lattice of the board's corners that the camera would see."""
    ids = _lattice(board)
    pixels = camera.project(pose.transform(board.points[ids]))
    with np.errstate(invalid="ignore"):
        inside = ((pixels >= -0.5) & (pixels <= np.array(camera.image_size) - 0.5)).all(axis=1)
    return Detection(ids[inside], pixels[inside])


def _lattice(board: Board) -> Ids:
    """Ids of at most about `MOST_CORNERS` corners, first and last of each row and column among them."""
    columns, rows = board.grid
    thinned = max(1.0, np.sqrt(columns * rows / MOST_CORNERS))
    x, y = (np.unique(np.linspace(0, n - 1, max(2, round(n / thinned))).round().astype(int)) for n in (columns, rows))
    return np.asarray((y[:, None] * columns + x).ravel(), dtype=np.int64)
