"""Normal equations taken apart by Schur complements: steps and covariances.

Poses touch each other only through the camera and the board, and corners only through the camera and the poses. So
the more numerous of the two kinds is eliminated block by block, and what remains is a dense matrix of the other kind
and of the shared unknowns, with these last: the tail of its Cholesky factor then is that of the shared unknowns' own
information, everything else marginalised. Source: Triggs and others, "Bundle adjustment: a modern synthesis", 2000.

Where corners are solved for, the seven steps of `NormalEquations.gauge` change nothing that is observed. They are held
at zero by adding their projector, which moves no observable quantity by any amount: no corner and no pose is held,
since more than seven conditions bias the answer.

With more views than corners nothing is kept whose size grows with both: what ties the poses to the corners is made
again, view after view, where it is needed.
"""

import mmap
from abc import ABC, abstractmethod
from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.jacobian import CORNER, POSE
from opencsp_calib.normal_equations import NormalEquations, Parts
from opencsp_calib.triangular import CholeskyRoot

__all__ = ["CornersKept", "Factorisation", "PosesKept", "factorise"]

STRIP = 128  # rows of a product made at once: the whole would be as large as the matrix that it is for
TOGETHER = 32  # views whose poses are eliminated at once: matrices large enough for BLAS


@dataclass(frozen=True, eq=False)
class Factorisation(ABC):
    """A factored normal matrix, ready to solve with.

    Parameters
    ----------
    equations : NormalEquations
    inverse_roots : (D, d, d)
        Inverses of the Cholesky factors of the D eliminated blocks.
    scale : (n,)
        One over the root of the dense matrix's diagonal.
    root : CholeskyRoot
        Of the scaled dense matrix (n, n): of what was kept, then of the M shared unknowns.
    """

    equations: NormalEquations
    inverse_roots: Floats
    scale: Floats
    root: CholeskyRoot

    @property
    def shared_covariance(self) -> Matrix:
        """(M, M) inverse of the shared unknowns' information; multiply by s² for their covariance."""
        half = np.linalg.inv(self.shared_root)
        return np.asarray(half @ half.T)

    @property
    def shared_root(self) -> Matrix:
        """(M, M) upper triangular R, with RᵀR the information of the shared unknowns, all else marginalised."""
        shared = self.equations.unknowns.shared
        return np.asarray(np.tril(self.root.lower[-shared:, -shared:]).T / self.scale[-shared:])

    @property
    def camera_covariance(self) -> Matrix:
        """(P, P) inverse information of the camera's parameters, all else marginalised; times s² their covariance."""
        basis = self.equations.unknowns.camera
        cameras = basis.shape[1]
        return np.asarray(basis @ self.shared_covariance[:cameras, :cameras] @ basis.T)

    @abstractmethod
    def newton_step(self) -> Parts:
        """By how much the unknowns move to where the sum of squares is least, as far as it is a quadratic form."""

    def following(self, shared: Floats) -> Parts:
        """The step of corners and poses to where the sum of squares is least after a given one (M,) of the shared."""
        newton = self.step_without_poses()
        pulled = self.solve_without_poses(np.eye(len(newton), len(shared)))
        lacking = np.linalg.solve(pulled[: len(shared)], newton[: len(shared)] - shared)
        corners = (newton - pulled @ lacking)[len(shared) :].reshape(CORNER, -1)
        return (
            shared,
            corners.T,
            self._poses_after(shared, corners, np.linalg.inv(np.linalg.cholesky(self.equations.pose))),
        )

    def _poses_after(self, shared: Floats, corners: Floats, inverse_roots: Floats) -> Floats:
        """(V, 6) of the poses, by the inverse roots of their blocks, where the others' step is given: (M,), (3, C)."""
        pose = -self.equations.pose_gradient - shared @ self.equations.shared_pose
        for rows in self.equations.rows():
            moved = (rows.corner * corners[:, rows.columns]).sum(axis=1)
            pose[rows.view] -= (rows.pose @ moved[:, :, None]).sum(axis=0)[:, 0]
        return np.asarray((inverse_roots.transpose(0, 2, 1) @ (inverse_roots @ pose[:, :, None]))[:, :, 0])

    @abstractmethod
    def step_without_poses(self) -> Floats:
        """(M + 3 C,) of the Newton step all but the poses, in the order of `solve_without_poses`."""

    @abstractmethod
    def solve_without_poses(self, right: Floats) -> Floats:
        """Solutions (M + 3 C, R) for right-hand sides from which the poses are eliminated.

        By [shared | x of the corners | y of the corners | z of the corners].
        """

    def _dense(self, right: Floats) -> Floats:
        """Solutions with the dense matrix, (n,) or (n, R)."""
        scale = self.scale.reshape(-1, *[1] * (right.ndim - 1))
        return np.asarray(scale * self.root.solve(scale * right))


def factorise(equations: NormalEquations, damping: float = 0.0) -> Factorisation:
    """Factor the normal matrix, its diagonal multiplied by one plus the damping.

    Raises
    ------
    numpy.linalg.LinAlgError
        If it is singular to working precision, or has NaN.
    """
    views, corners = len(equations.pose), len(equations.corner)
    kind = PosesKept if POSE * views < CORNER * corners else CornersKept
    return kind.of(equations, damping)


@dataclass(frozen=True, eq=False)
class PosesKept(Factorisation):
    """Corners eliminated one by one: for more corners than views.

    Parameters
    ----------
    coupling : (3, 6 V + M, C)
        What ties the rest to the corners, multiplied by the corners' inverse roots.
    """

    coupling: Floats

    @classmethod
    def of(cls, equations: NormalEquations, damping: float) -> "PosesKept":
        """See `factorise`."""
        inverse_roots = np.linalg.inv(np.linalg.cholesky(_damped(equations.corner, damping)))
        poses = equations.pose_gradient.size
        coupling = np.zeros((CORNER, poses + equations.unknowns.shared, len(inverse_roots)))
        by_root = np.ascontiguousarray(inverse_roots.transpose(1, 2, 0))
        for rows in equations.rows():
            corner = np.einsum("ikn,akn->ain", by_root[:, :, rows.columns], rows.corner)
            of_view = slice(POSE * rows.view, POSE * rows.view + POSE)
            coupling[:, of_view, rows.columns] = np.einsum("ain,apn->ipn", corner, rows.pose)
        coupling[:, poses:] = np.einsum("ikn,kmn->imn", by_root, equations.corner_shared)
        ties = equations.shared_pose.transpose(0, 2, 1).reshape(poses, -1)
        shared = _damped(equations.shared.sum(axis=0), damping)
        reduced = np.block([[_block_diagonal(_damped(equations.pose, damping)), ties], [ties.T, shared]])
        for part in coupling:
            _subtract_lower(reduced, part.T, part.T)
        return cls(equations, inverse_roots, *_scaled_root(reduced, equations.gauge()[1].reshape(poses, -1)), coupling)

    def newton_step(self) -> Parts:
        """See `Factorisation.newton_step`."""
        shared, corner, pose = self.equations.gradient
        dense, inner = self._solved(-np.concatenate([pose.ravel(), shared]), -corner.T)
        return dense[pose.size :], inner.T, dense[: pose.size].reshape(pose.shape)

    def step_without_poses(self) -> Floats:
        """See `Factorisation.step_without_poses`."""
        shared, corner, _ = self.newton_step()
        return np.concatenate([shared, corner.T.ravel()])

    def solve_without_poses(self, right: Floats) -> Floats:
        """See `Factorisation.solve_without_poses`."""
        right = np.ascontiguousarray(right)  # whose columns one after the other would take five times as long
        shared, columns = self.equations.unknowns.shared, right.shape[1]
        poses = np.zeros((self.equations.pose_gradient.size, columns))
        corners = right[shared:].reshape(CORNER, -1, columns)
        dense, inner = self._solved(np.concatenate([poses, right[:shared]]), corners)
        return np.concatenate([dense[len(poses) :], inner.reshape(-1, columns)])

    def _solved(self, kept: Floats, corner: Floats) -> tuple[Floats, Floats]:
        """Of the poses and shared unknowns (6 V + M, ...), and of the corners (3, C, ...)."""
        inner = np.einsum("cik,kc...->ic...", self.inverse_roots, corner)
        dense = self._dense(kept - sum(part @ column for part, column in zip(self.coupling, inner, strict=True)))
        inner -= [part.T @ dense for part in self.coupling]
        return dense, np.einsum("cik,ic...->kc...", self.inverse_roots, inner)


@dataclass(frozen=True, eq=False)
class CornersKept(Factorisation):
    """Poses eliminated one by one: where the board is flat, or there are more views than corners.

    Parameters
    ----------
    gradient : (3 C + M,)
        Of what is kept, the poses eliminated: made along with the matrix, from the same rows of J.
    """

    gradient: Floats

    @classmethod
    def of(cls, equations: NormalEquations, damping: float) -> "CornersKept":
        """See `factorise`."""
        inverse_roots = np.linalg.inv(np.linalg.cholesky(_damped(equations.pose, damping)))
        corners = CORNER * len(equations.corner)
        every, blocks = np.arange(len(equations.corner)), _damped(equations.corner, damping)
        reduced = _zeros_apart(corners + equations.unknowns.shared)
        for row, column in np.ndindex(CORNER, CORNER):
            reduced[row * len(every) + every, column * len(every) + every] = blocks[:, row, column]
        reduced[corners:, :corners] = equations.corner_shared.swapaxes(0, 1).reshape(equations.unknowns.shared, corners)
        reduced[corners:, corners:] = _damped(equations.shared.sum(axis=0), damping)
        gradient = np.concatenate([equations.corner_gradient.T.ravel(), equations.shared_gradient.sum(axis=0)])
        for begin in range(0, len(inverse_roots), TOGETHER):
            _eliminate(equations, inverse_roots, slice(begin, begin + TOGETHER), reduced, gradient)
        gauge = equations.gauge()[0].transpose(1, 0, 2).reshape(corners, 7)
        return cls(equations, inverse_roots, *_scaled_root(reduced, gauge), gradient)

    def newton_step(self) -> Parts:
        """See `Factorisation.newton_step`."""
        shared, corners = np.split(self.step_without_poses(), [self.equations.unknowns.shared])
        corners = corners.reshape(CORNER, -1)
        return shared, corners.T, self._poses_after(shared, corners, self.inverse_roots)

    def step_without_poses(self) -> Floats:
        """See `Factorisation.step_without_poses`."""
        return np.roll(self._dense(-self.gradient), self.equations.unknowns.shared)

    def solve_without_poses(self, right: Floats) -> Floats:
        """See `Factorisation.solve_without_poses`."""
        shared = self.equations.unknowns.shared
        return np.roll(self._dense(np.roll(right, -shared, axis=0)), shared, axis=0)


def _eliminate(
    equations: NormalEquations, inverse_roots: Floats, views: slice, reduced: Matrix, gradient: Floats
) -> None:
    """Take the poses of a run of views out of what is kept: its matrix (3 C + M, 3 C + M) and its gradient (3 C + M,).

    What ties one run's poses to the rest is a megabyte or more, and gone before the next one's is made.
    """
    coupling = _coupling(equations, inverse_roots, views)
    alone = inverse_roots[views] @ equations.pose_gradient[views, :, None]
    _subtract_lower(reduced, coupling, coupling)
    gradient -= alone.ravel() @ coupling


def _coupling(equations: NormalEquations, inverse_roots: Floats, views: slice) -> Matrix:
    """(6 n, 3 C + M) what ties the poses of n views to the rest, multiplied by the poses' inverse roots."""
    corners = len(equations.corner)
    shared_pose = equations.shared_pose[views]
    ties = np.zeros((len(shared_pose), POSE, CORNER * corners + equations.unknowns.shared))
    ties[:, :, CORNER * corners :] = shared_pose.transpose(0, 2, 1)
    blocks = ties[:, :, : CORNER * corners].reshape(len(ties), POSE, CORNER, corners)
    for rows in equations.rows(views.start, views.start + len(ties)):
        blocks[rows.view - views.start][:, :, rows.columns] = rows.pose_corner()
    return np.asarray((inverse_roots[views] @ ties).reshape(-1, ties.shape[2]))


def _zeros_apart(size: int) -> Matrix:
    """(size, size) in memory of their own, which goes back to the system with them: a heap would keep it.

    Where nothing is written, as above the diagonal, they take none.
    """
    memory = mmap.mmap(-1, size * size * np.dtype(np.float64).itemsize)
    return np.frombuffer(memory, dtype=np.float64).reshape(size, size)


def _damped(blocks: Floats, damping: float) -> Floats:
    return blocks * (1.0 + damping * np.eye(blocks.shape[-1]))


def _block_diagonal(blocks: Floats) -> Matrix:
    """(n d, n d) of blocks (n, d, d)."""
    count, size = blocks.shape[:2]
    matrix = np.zeros((count, size, count, size))
    matrix[np.arange(count), :, np.arange(count)] = blocks
    return matrix.reshape(count * size, count * size)


def _subtract_lower(matrix: Matrix, left: Matrix, right: Matrix) -> None:
    """Take leftᵀ right (k, k), of matrices (n, k), from a lower triangle, and from a little above: half of the work."""
    for first in range(0, len(matrix), STRIP):
        strip = slice(first, min(first + STRIP, len(matrix)))
        matrix[strip, : strip.stop] += -left[:, strip].T @ right[:, : strip.stop]


def _scaled_root(dense: Matrix, gauge: Floats) -> tuple[Floats, CholeskyRoot]:
    """Scale and lower Cholesky factor of a dense matrix, with the gauge's projector added; see `Factorisation`.

    Of the matrix, which is overwritten as by `CholeskyRoot.of`, nothing but the lower triangle counts.
    """
    diagonal = np.diag(dense)
    if not (diagonal > 0).all():
        raise np.linalg.LinAlgError("an unknown is not observed at all")
    scale = 1.0 / np.sqrt(diagonal)
    for first in range(0, len(dense), STRIP):  # the strips of the lower triangle, as `_subtract_lower` goes over them
        strip = slice(first, min(first + STRIP, len(dense)))
        dense[strip, : strip.stop] *= scale[strip, None]
        dense[strip, : strip.stop] *= scale[: strip.stop]
    if gauge.any():
        free, _ = np.linalg.qr(gauge / scale[: len(gauge), None])
        _subtract_lower(dense[: len(gauge), : len(gauge)], -free.T, free.T)
    return scale, CholeskyRoot.of(dense)
