"""Where the board is: a rotation and a translation that take board points into the camera's frame."""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Matrix, Points, Vector, frozen
from opencsp_calib.rotations import rotation_matrices, rotation_vectors

__all__ = ["Pose"]


@dataclass(frozen=True, eq=False)
class Pose:
    """A rigid motion, board to camera: ``camera point = R board point + t``.

    Parameters
    ----------
    rotation : (3,) rad
        Rotation vector: axis times angle, as OpenCV's ``rvec``.
    translation : (3,) m
    """

    rotation: Vector
    translation: Vector

    def __post_init__(self) -> None:
        object.__setattr__(self, "rotation", frozen(self.rotation, "rotation", (3,)))
        object.__setattr__(self, "translation", frozen(self.translation, "translation", (3,)))

    @classmethod
    def from_matrix(cls, rotation: Matrix, translation: Vector) -> "Pose":
        """From a rotation matrix (3, 3) and a translation (3,) m."""
        return cls(rotation_vectors(rotation), translation)

    @property
    def matrix(self) -> Matrix:
        """(3, 3) rotation matrix."""
        return rotation_matrices(self.rotation)

    @property
    def tilt_deg(self) -> float:
        """Between the board's normal and the optical axis: 0 is head-on."""
        return float(np.degrees(np.arccos(min(1.0, abs(self.matrix[2, 2])))))

    def transform(self, points: Points) -> Points:
        """(N, 3) m board points in the camera's frame."""
        return np.asarray(points @ self.matrix.T + self.translation, dtype=np.float64)

    def inverse(self) -> "Pose":
        """Camera to board."""
        return Pose(-self.rotation, -self.matrix.T @ self.translation)

    def after(self, first: "Pose") -> "Pose":
        """The motion that does `first`, then this one."""
        return Pose.from_matrix(self.matrix @ first.matrix, self.transform(first.translation[None])[0])

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Pose):
            return NotImplemented
        return np.array_equal(self.rotation, other.rotation) and np.array_equal(self.translation, other.translation)

    __hash__ = None  # type: ignore[assignment]  # holds arrays
