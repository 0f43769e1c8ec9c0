"""How much each view tells about a camera, and how well a set of views lets the camera be used: before it is solved.

A view's information is its part of the normal matrix with its own pose marginalised (the Schur complement of the pose),
so that informations of views add up, whether they have been photographed or are only thought of. What they are for is
projection: the variance of where the camera sees things, over the image, after the change of frame that `compare` fits
has been projected out. Views that are chosen to make that variance small are I-optimal (or V-optimal) in the words of
the design of experiments (Atkinson, Donev and Tobias, "Optimum experimental designs", 2007).

A weak prior stands in for what a few views leave open, so that even the first of them can be told apart: it holds
nothing that three good views do not know far better.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.comparison import GRID
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.detection import Detection
from opencsp_calib.normal_equations import linearise
from opencsp_calib.options import BoardShape, SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.projection_sigma import Alignment
from opencsp_calib.unknowns import Estimate, Unknowns

__all__ = ["GOAL_PX", "ProjectionGoal", "view_information"]

GOAL_PX = 0.1  # rms over the image: a tenth of a pixel is well below what a measurement with the camera resolves
PRIOR_FOCAL, PRIOR_MIDDLE = 0.5, 0.25  # sigmas, in focal lengths and in image sides
PRIOR_DISTORTION = 1.0  # sigma of every coefficient
PRIOR_WARP = 0.01  # sigma of each bend of the board, in parts of its size
OPEN = 1e-12  # of the largest eigenvalue of a pose's information: below it, what is there is rounding

FLAT = SolveOptions()


def view_information(
    camera: Camera,
    board: Board,
    detections: Sequence[Detection],
    poses: Sequence[Pose],
    *,
    options: SolveOptions = FLAT,
    sigma_px: float = 1.0,
) -> Floats:
    """What each view tells about the unknowns that all views share, its own pose marginalised.

    Parameters
    ----------
    camera : Camera
        About as it will be solved.
    board : Board
    detections : sequence of Detection
        One a view. Where a corner is matters little: only which corners are seen, and how they are weighted.
    poses : sequence of Pose
        Board to camera, one a view.
    options : SolveOptions
        Of which `board_shape` (where the corners are free, as for a warp: no view alone tells of a single corner),
        `pixel_aspect` and `weights` count.
    sigma_px : float
        Of a corner, per axis; with weights by covariance, the factor on what they state.

    Returns
    -------
    (V, M, M)
        Of the camera's Q free parameters, then of the board's warp where it is solved for. Zero for a view of too few
        corners to tell even its pose, or one that the lens model cannot image.
    """
    unknowns = _unknowns(camera, board, options)
    estimate = Estimate(
        camera.params,
        np.array([pose.matrix for pose in poses]).reshape(-1, 3, 3),
        np.array([pose.translation for pose in poses]).reshape(-1, 3),
        board.points,
    )
    equations = linearise(camera.lens, CornerTable.of(detections, options.weights), estimate, unknowns)
    imaged = np.isfinite(equations.dense).all(axis=(1, 2))
    information = np.zeros((len(poses), unknowns.shared, unknowns.shared))
    # the pseudo-inverse, since a few corners, or corners on a line, leave the pose open: they tell nothing, or little
    inverse_pose = np.linalg.pinv(equations.pose[imaged], rcond=OPEN, hermitian=True)
    cross = equations.shared_pose[imaged]
    information[imaged] = equations.shared[imaged] - cross @ inverse_pose @ cross.transpose(0, 2, 1)
    return information / sigma_px**2


@dataclass(frozen=True, eq=False)
class ProjectionGoal:
    """What views are taken for: that the camera's projections are certain all over the image.

    Parameters
    ----------
    by_unknowns : (M, M) px²
        Mean over the image of JᵀJ, J being how aligned projections move with the unknowns that all views share.
    prior : (M,)
        Information that is there before the first view, of each unknown.
    """

    by_unknowns: Matrix = field(repr=False)
    prior: Floats = field(repr=False)

    @classmethod
    def of(
        cls,
        camera: Camera,
        board: Board,
        range_m: float | None = None,
        *,
        options: SolveOptions = FLAT,
        grid: tuple[int, int] = GRID,
    ) -> "ProjectionGoal":
        """Of a camera used at a range, None being infinity; the options as for `view_information`."""
        ranges = () if range_m is None else (range_m,)
        aligned = Alignment.at_range(camera, *ranges, grid=grid) if ranges else Alignment.at_infinity(camera, grid)
        unknowns = _unknowns(camera, board, options)
        jacobian = aligned.grid_jacobian @ unknowns.camera
        free, shared = unknowns.camera.shape[1], unknowns.shared
        by_unknowns = np.zeros((shared, shared))
        by_unknowns[:free, :free] = np.einsum("nij,nik->jk", jacobian, jacobian) / len(jacobian)
        return cls(by_unknowns, 1.0 / _prior_sigmas(camera, board, unknowns) ** 2)

    def variance_px2(self, information: Floats) -> Floats:
        """Expected squared length of the error of a projection, mean over the image.

        Parameters
        ----------
        information : (..., M, M)
            Sums of the informations of the views in each set.

        Returns
        -------
        (...) px²
        """
        scale = 1.0 / np.sqrt(self.prior)  # in units of the prior, so that unknowns of all kinds are of one size
        scaled = information * scale[:, None] * scale + np.eye(len(scale))
        goal = self.by_unknowns * scale[:, None] * scale
        return np.asarray(np.trace(np.linalg.solve(scaled, np.broadcast_to(goal, scaled.shape)), axis1=-2, axis2=-1))

    def gains(self, known: Matrix, candidates: Floats) -> Floats:
        """What each further view would be worth.

        Parameters
        ----------
        known : (M, M)
            Information of the views there are; zeros for none.
        candidates : (V, M, M)
            Of views that could be added.

        Returns
        -------
        (V,)
            By which part the expected variance would fall: 0 for a view that tells nothing, near 1 for one that tells
            almost everything.
        """
        return np.asarray(1.0 - self.variance_px2(known + candidates) / self.variance_px2(known))


def _unknowns(camera: Camera, board: Board, options: SolveOptions) -> Unknowns:
    shape: BoardShape = "flat" if options.board_shape == "flat" else "warp"
    chosen = SolveOptions(board_shape=shape, pixel_aspect=options.pixel_aspect)
    return Unknowns.of(camera.lens, board, np.empty(0, dtype=np.int64), chosen)


def _prior_sigmas(camera: Camera, board: Board, unknowns: Unknowns) -> Floats:
    params = np.full(len(camera.params), PRIOR_DISTORTION)
    params[:2] = PRIOR_FOCAL * camera.params[:2]
    params[2:4] = PRIOR_MIDDLE * np.array(camera.image_size)
    of_camera = 1.0 / np.sqrt(((unknowns.camera / params[:, None]) ** 2).sum(axis=0))
    of_warp = np.full(unknowns.warp.shape[2], PRIOR_WARP * np.ptp(board.nominal_points, axis=0).max())
    return np.concatenate([of_camera, of_warp])
