"""What a calibration solves for, and the values it has reached."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Matrix, Params, Points
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration
from opencsp_calib.models import LensModel
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.rotations import rotation_matrices, rotation_vectors

__all__ = ["Estimate", "Unknowns", "camera_basis", "warp_basis"]


@dataclass(frozen=True, eq=False)
class Estimate:
    """Values of everything that can be solved for.

    Parameters
    ----------
    params : (P,)
        Of the camera.
    rotations : (V, 3, 3)
    translations : (V, 3) m
    points : (K, 3) m
        Of the board.
    """

    params: Params
    rotations: Floats
    translations: Floats
    points: Points

    @classmethod
    def of(cls, calibration: Calibration) -> "Estimate":
        """A calibration's values."""
        return cls.posed(calibration.camera.params, calibration.cam_from_board, calibration.board.points)

    @classmethod
    def posed(cls, params: Params, cam_from_board: Sequence[Pose], points: Points) -> "Estimate":
        """With the poses of all views."""
        turns = np.array([pose.rotation for pose in cam_from_board]).reshape(-1, 3)
        shifts = np.array([pose.translation for pose in cam_from_board]).reshape(-1, 3)
        return cls(params, rotation_matrices(turns), shifts, points)

    @property
    def poses(self) -> tuple[Pose, ...]:
        """Of each view."""
        vectors = rotation_vectors(self.rotations)
        return tuple(Pose(r, t) for r, t in zip(vectors, self.translations, strict=True))

    def of_views(self, views: slice) -> "Estimate":
        """With the poses of some views only."""
        return replace(self, rotations=self.rotations[views], translations=self.translations[views])

    def moved(self, unknowns: "Unknowns", shared: Floats, corner: Floats, pose: Floats) -> "Estimate":
        """After a step of the unknowns: (M,), (C, 3) m and (V, 6)."""
        cameras = unknowns.camera.shape[1]
        points = self.points + unknowns.warp @ shared[cameras:]
        points[unknowns.corners] += corner
        return Estimate(
            self.params + unknowns.of_camera(shared),
            rotation_matrices(pose[:, :3]) @ self.rotations,
            self.translations + pose[:, 3:],
            points,
        )


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What is solved for besides the poses, which always are.

    Parameters
    ----------
    camera : (P, Q)
        How the camera's parameters follow from its unknowns: the identity; with fy/fx held, one column for both; or
        combinations that are better told apart.
    warp : (K, 3, W) m
        Shift of each corner of the board per unit of each warp unknown; W = 0 for none.
    corners : (C,) int
        Ids of the board's corners that are solved for one by one. Where there are any, corners that are not among them
        must not be in the table: seven unknowns (a similarity of the board) are then free, and nothing else.
    """

    camera: Matrix
    warp: Floats
    corners: Ids

    @classmethod
    def of(cls, lens: LensModel, board: Board, corners: Ids, options: SolveOptions) -> "Unknowns":
        """What the options ask for, with the corners that can be solved for where the board's shape is free."""
        camera = camera_basis(len(lens.parameter_names), options.pixel_aspect)
        warp = warp_basis(board) if options.board_shape == "warp" else np.zeros((len(board.points), 3, 0))
        free = options.board_shape == "free"
        return cls(camera, warp, corners if free else np.empty(0, dtype=np.int64))

    def of_camera(self, shared: Floats) -> Params:
        """(..., P) how the camera's parameters change with a change (..., M) of the shared unknowns."""
        return np.asarray(shared[..., : self.camera.shape[1]] @ self.camera.T)

    @property
    def shared(self) -> int:
        """M, the number of unknowns that all views share."""
        return int(self.camera.shape[1] + self.warp.shape[2])


def camera_basis(count: int, pixel_aspect: float | None) -> Matrix:
    """(P, Q) how P parameters of a camera follow from its unknowns: with fy/fx held, one column for both."""
    basis = np.eye(count)
    if pixel_aspect is None:
        return basis
    basis[1, 0] = pixel_aspect
    return np.delete(basis, 1, axis=1)


def warp_basis(board: Board) -> Floats:
    """(K, 3, 5) m: what boards are most often wrong by, for where data are too few to solve for every corner.

    Three bends out of the plane (u², u v and v² with u and v the place on the board), a difference between the
    spacings along x and y, and a shear; each shifts corners by up to about one metre, and holds no shift, turn or
    scale of the board as a whole. The last two matter as much as the bends: a board of which the spacings differ by
    0.2 % spoils a camera more than one bowed by a millimetre.
    """
    place = board.nominal_points - board.nominal_points.mean(axis=0)
    x, y = (place[:, :2] / np.abs(place).max()).T
    none = np.zeros_like(x)
    shifts = [(none, none, x * x), (none, none, x * y), (none, none, y * y), (x, -y, none), (y, x, none)]
    basis = np.array(shifts).transpose(2, 1, 0).reshape(-1, len(shifts))
    turns = np.cross(np.eye(3)[:, None, :], place).reshape(3, -1).T
    similarity = np.column_stack([np.tile(np.eye(3), (len(place), 1)), turns, place.ravel()])
    basis -= similarity @ np.linalg.lstsq(similarity, basis, rcond=None)[0]
    return np.asarray(basis.reshape(len(place), 3, len(shifts)), dtype=np.float64)
