"""What a calibration solves for, and the values it has reached."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from opencsp_calib.arrays import Floats, Ids, Matrix, Params, Points
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration
from opencsp_calib.models import LensModel
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose

__all__ = ["Estimate", "Unknowns", "warp_basis"]


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
        poses = calibration.cam_from_board
        return cls(
            calibration.camera.params,
            Rotation.from_rotvec(np.array([p.rotation for p in poses]).reshape(-1, 3)).as_matrix(),
            np.array([p.translation for p in poses]).reshape(-1, 3),
            calibration.board.points,
        )

    @property
    def poses(self) -> tuple[Pose, ...]:
        """Of each view."""
        vectors = Rotation.from_matrix(self.rotations).as_rotvec()
        return tuple(Pose(r, t) for r, t in zip(vectors, self.translations, strict=True))

    def moved(self, unknowns: "Unknowns", shared: Floats, corner: Floats, pose: Floats) -> "Estimate":
        """After a step of the unknowns: (M,), (C, 3) m and (V, 6)."""
        cameras = unknowns.camera.shape[1]
        points = self.points + unknowns.warp @ shared[cameras:]
        points[unknowns.corners] += corner
        return Estimate(
            self.params + unknowns.camera @ shared[:cameras],
            np.asarray(Rotation.from_rotvec(pose[:, :3]).as_matrix() @ self.rotations),
            self.translations + pose[:, 3:],
            points,
        )


@dataclass(frozen=True, eq=False)
class Unknowns:
    """What is solved for besides the poses, which always are.

    Parameters
    ----------
    camera : (P, Q)
        How the camera's parameters follow from its unknowns: the identity, or with fy/fx held one column for both.
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
        size, count = len(lens.parameter_names), len(board.points)
        camera = np.eye(size)
        if options.pixel_aspect is not None:
            camera[1, 0] = options.pixel_aspect
            camera = np.delete(camera, 1, axis=1)
        warp = warp_basis(board) if options.board_shape == "warp" else np.zeros((count, 3, 0))
        free = options.board_shape == "free"
        return cls(camera, warp, corners if free else np.empty(0, dtype=np.int64))

    @property
    def shared(self) -> int:
        """M, the number of unknowns that all views share."""
        return int(self.camera.shape[1] + self.warp.shape[2])


def warp_basis(board: Board) -> Floats:
    """(K, 3, W) m: the smooth warps of a board, as heights out of its nominal plane.

    With u and v running from -1 to 1 along the board, heights are polynomials of second to fourth degree in u and v,
    twelve in all, each one metre where it is 1: what bending and twisting of a plate looks like, and no more.
    """
    plane = board.nominal_points[:, :2]
    low, high = plane.min(axis=0), plane.max(axis=0)
    u, v = ((2.0 * plane - low - high) / (high - low)).T
    heights = [u**i * v ** (degree - i) for degree in (2, 3, 4) for i in range(degree + 1)]
    basis = np.zeros((len(plane), 3, len(heights)))
    basis[:, 2] = np.column_stack(heights)
    return basis
