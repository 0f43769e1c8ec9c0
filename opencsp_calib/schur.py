"""Normal equations taken apart by Schur complements: steps, covariances, and every view left out in turn.

Poses touch each other only through the camera and the board, and corners only through the camera and the poses. So
the more numerous of the two kinds is eliminated block by block, and what remains is a dense matrix of the other kind
and of the shared unknowns, with these last: the tail of its Cholesky factor then is that of the shared unknowns' own
information, everything else marginalised. Source: Triggs and others, "Bundle adjustment: a modern synthesis", 2000.

Where corners are solved for, the seven steps of `NormalEquations.corner_gauge` change nothing that is observed. They
are held at zero by adding their projector, which moves no observable quantity by any amount: no corner and no pose is
held, since more than seven conditions bias the answer.
"""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.normal_equations import NormalEquations
from opencsp_calib.triangular import CholeskyRoot

__all__ = ["Factorisation", "camera_covariance", "camera_without_each_view", "factorise"]

CG_TOLERANCE = 1e-8  # of the step's length, in sigmas
CG_STEPS = 200


@dataclass(frozen=True, eq=False)
class Factorisation:
    """A factored normal matrix, ready to solve with.

    Parameters
    ----------
    poses_kept : bool
        Whether the corners were eliminated, and the poses are in the dense factor; otherwise the other way round.
    inverse_roots : (D, d, d)
        Inverses of the Cholesky factors of the D eliminated blocks.
    coupling : (D, d, kept + M)
        What ties the eliminated blocks to the rest, multiplied by the inverse roots.
    scale : (kept + M,)
        One over the root of the dense matrix's diagonal.
    root : CholeskyRoot
        Of the scaled dense matrix (kept + M, kept + M): of what was kept, then of the M shared unknowns.
    shared : int
        M.
    """

    poses_kept: bool
    inverse_roots: Floats
    coupling: Floats
    scale: Floats
    root: CholeskyRoot
    shared: int

    @property
    def shared_covariance(self) -> Matrix:
        """(M, M) inverse of the shared unknowns' information; multiply by s² for their covariance."""
        tail = self.root.lower[-self.shared :, -self.shared :]
        half = np.linalg.inv(tail) * self.scale[-self.shared :]
        return np.asarray(half.T @ half)

    def solve(self, shared: Floats, corner: Floats, pose: Floats) -> tuple[Floats, Floats, Floats]:
        """Solutions for right-hand sides (M, R), (C, 3, R) and (V, 6, R), in the same shapes."""
        kept, dropped = (pose, corner) if self.poses_kept else (corner, pose)
        columns = shared.shape[1]
        inner = self.inverse_roots @ dropped
        right = np.concatenate([kept.reshape(-1, columns), shared])
        right = right - _flat(self.coupling).T @ inner.reshape(-1, columns)
        dense = self.scale[:, None] * self.root.solve(self.scale[:, None] * right)
        inner = inner - (_flat(self.coupling) @ dense).reshape(inner.shape)
        dropped = self.inverse_roots.transpose(0, 2, 1) @ inner
        kept = dense[: len(dense) - self.shared].reshape(kept.shape)
        shared = dense[len(dense) - self.shared :]
        return (shared, dropped, kept) if self.poses_kept else (shared, kept, dropped)


def factorise(equations: NormalEquations, damping: float = 0.0) -> Factorisation:
    """Factor the normal matrix, its diagonal multiplied by one plus the damping.

    Raises
    ------
    numpy.linalg.LinAlgError
        If it is singular to working precision, or has NaN.
    """
    views, corners = equations.corner.shape[:2]
    poses_kept = 6 * views < 3 * corners
    by_corner = equations.by_corner[..., : 3 + equations.unknowns.shared].sum(axis=0)
    corner, corner_shared = by_corner[..., :3], by_corner[..., 3:]
    pose, pose_shared = equations.pose, equations.shared_pose.transpose(0, 2, 1)
    if poses_kept:
        kept, kept_shared, gauge = pose, pose_shared, equations.pose_gauge
        dropped, dropped_shared = corner, corner_shared
        cross = equations.corner_pose.transpose(1, 2, 0, 3)
    else:
        kept, kept_shared, gauge = corner, corner_shared, equations.corner_gauge
        dropped, dropped_shared = pose, pose_shared
        cross = equations.corner_pose.transpose(0, 3, 1, 2)
    inverse_roots = np.linalg.inv(np.linalg.cholesky(_damped(dropped, damping)))
    cross = np.concatenate([cross.reshape(*dropped.shape[:2], len(kept) * kept.shape[1]), dropped_shared], axis=2)
    coupling = inverse_roots @ cross
    shared = _damped(equations.shared.sum(axis=0), damping)
    reduced = _assembled(_damped(kept, damping), kept_shared, shared) - _flat(coupling).T @ _flat(coupling)
    scale, root = _scaled_root(reduced, gauge.reshape(-1, gauge.shape[2]))
    return Factorisation(poses_kept, inverse_roots, coupling, scale, root, len(shared))


def camera_covariance(equations: NormalEquations) -> Matrix:
    """(P, P) inverse information of the camera's parameters, poses and board marginalised; times s² their covariance.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the observations do not determine them.
    """
    basis = equations.unknowns.camera
    cameras = basis.shape[1]
    return np.asarray(basis @ factorise(equations).shared_covariance[:cameras, :cameras] @ basis.T)


def camera_without_each_view(equations: NormalEquations) -> Floats:
    """How the camera's parameters move when each view in turn is left out: one Newton step, everything solved again.

    Where the board's shape is free, all left-out views are solved for at once by conjugate gradients that start from
    the factor of the whole: one view of many changes little, so few steps are needed.

    Returns
    -------
    (V, P)
        Parameters without the view minus those with it; NaN where the others do not determine them.
    """
    cameras = equations.unknowns.camera.shape[1]
    steps = _without_by_iteration(equations) if len(equations.unknowns.corners) else _without_directly(equations)
    return np.asarray(steps[:, :cameras] @ equations.unknowns.camera.T)


def _without_directly(equations: NormalEquations) -> Floats:
    """(V, M): with a small dense matrix for each view."""
    solved = np.linalg.solve(
        equations.pose,
        np.concatenate([equations.shared_pose.transpose(0, 2, 1), equations.pose_gradient[..., None]], axis=2),
    )
    information = equations.shared - equations.shared_pose @ solved[..., :-1]
    gradient = equations.shared_gradient - (equations.shared_pose @ solved[..., -1:])[..., 0]
    rest, rest_gradient = information.sum(axis=0) - information, gradient.sum(axis=0) - gradient
    steps = np.full(gradient.shape, np.nan)
    for view, (matrix, right) in enumerate(zip(rest, rest_gradient, strict=True)):
        scale = 1.0 / np.sqrt(np.diag(matrix))
        try:
            root = CholeskyRoot.of(scale[:, None] * matrix * scale)
        except np.linalg.LinAlgError:
            continue  # stays NaN: the other views leave something open
        steps[view] = -scale * root.solve((scale * right)[:, None])[:, 0]
    return steps


def _without_by_iteration(equations: NormalEquations) -> Floats:
    """(V, M): preconditioned conjugate gradients on S - S_v, S being factored and S_v of one view, poses eliminated.

    The product of S with the search direction follows from the recurrence, so S itself is never needed. Both are
    singular in the directions of the gauge, which right-hand sides have no part in.
    """
    shared = equations.shared.shape[1]
    whole = factorise(equations)
    inverse_pose = np.asarray(np.linalg.inv(equations.pose), dtype=np.float64)
    right = _view_gradient(equations, inverse_pose)
    x, residual = np.zeros_like(right), right.copy()
    direction, whole_direction = np.zeros_like(right), np.zeros_like(right)
    before = np.ones(len(right))
    for step in range(CG_STEPS):
        preconditioned = _whole_inverse(whole, residual, shared)
        now = np.einsum("vi,vi->v", residual, preconditioned)
        if step == 0:
            start = now.copy()
        active = now > CG_TOLERANCE**2 * start
        if not active.any():
            break
        factor = np.where(active, now / before, 0.0) if step else np.zeros_like(now)
        direction = preconditioned + factor[:, None] * direction
        whole_direction = residual + factor[:, None] * whole_direction
        product = whole_direction - _view_product(equations, inverse_pose, direction)
        curvature = np.einsum("vi,vi->v", direction, product)
        length = np.divide(now, curvature, out=np.zeros_like(now), where=active & (curvature > 0))
        x += length[:, None] * direction
        residual -= length[:, None] * product
        before = np.where(active, now, 1.0)
    x[active] = np.nan
    return x[:, :shared]


def _view_gradient(equations: NormalEquations, inverse_pose: Floats) -> Floats:
    """(V, M + 3 C): each view's own gradient by the shared unknowns and the corners, its pose eliminated."""
    views = len(equations.pose)
    gradient = np.concatenate([equations.shared_gradient, equations.corner_gradient.reshape(views, -1)], axis=1)
    return gradient - _from_pose(equations, inverse_pose @ equations.pose_gradient[..., None])


def _view_product(equations: NormalEquations, inverse_pose: Floats, x: Floats) -> Floats:
    """(V, M + 3 C): each view's own matrix, its pose eliminated, times a vector of its own."""
    views, shared = len(x), equations.shared.shape[1]
    ours, corners = x[:, :shared, None], x[:, shared:].reshape(views, -1, 3, 1)
    by_corner = equations.by_corner.reshape(views, -1, shared + 10)
    from_corners = by_corner.transpose(0, 2, 1) @ x[:, shared:, None]
    pose = equations.shared_pose.transpose(0, 2, 1) @ ours + from_corners[:, 3 + shared : -1]
    of_shared = equations.shared @ ours + from_corners[:, 3 : 3 + shared]
    of_corners = (equations.corner @ corners).reshape(views, -1) + (by_corner[..., 3 : 3 + shared] @ ours)[..., 0]
    return np.concatenate([of_shared[..., 0], of_corners], axis=1) - _from_pose(equations, inverse_pose @ pose)


def _from_pose(equations: NormalEquations, pose: Floats) -> Floats:
    """(V, M + 3 C): the blocks that tie each view's pose to the rest, times (V, 6, 1)."""
    of_corners = equations.corner_pose.reshape(len(pose), -1, 6) @ pose
    return np.concatenate([equations.shared_pose @ pose, of_corners], axis=1)[..., 0]


def _whole_inverse(whole: Factorisation, vectors: Floats, shared: int) -> Floats:
    """(V, M + 3 C): the whole's inverse, poses eliminated, times a vector for each view."""
    views = len(vectors)
    solved = whole.solve(
        vectors[:, :shared].T, vectors[:, shared:].T.reshape(-1, 3, views), np.zeros((views, 6, views))
    )
    return np.concatenate([solved[0].T, solved[1].reshape(-1, views).T], axis=1)


def _flat(blocks: Floats) -> Floats:
    return blocks.reshape(-1, blocks.shape[2])


def _damped(blocks: Floats, damping: float) -> Floats:
    return blocks * (1.0 + damping * np.eye(blocks.shape[-1]))


def _assembled(blocks: Floats, cross: Floats, shared: Floats) -> Matrix:
    """The dense matrix of kept blocks (n, d, d), what ties them to the shared unknowns (n, d, M), and these (M, M)."""
    count, size = blocks.shape[:2]
    end = count * size
    dense = np.zeros((end + len(shared), end + len(shared)))
    index = np.arange(end).reshape(count, size)
    dense[index[:, :, None], index[:, None, :]] = blocks
    dense[:end, end:] = cross.reshape(end, len(shared))
    dense[end:, :end] = dense[:end, end:].T
    dense[end:, end:] = shared
    return dense


def _scaled_root(dense: Matrix, gauge: Floats) -> tuple[Floats, CholeskyRoot]:
    """Scale and lower Cholesky factor of a dense matrix, with the gauge's projector added; see `Factorisation`."""
    diagonal = np.diag(dense)
    if not (diagonal > 0).all():
        raise np.linalg.LinAlgError("an unknown is not observed at all")
    scale = 1.0 / np.sqrt(diagonal)
    scaled = dense * scale[:, None] * scale
    if gauge.any():
        free, _ = np.linalg.qr(gauge / scale[: len(gauge), None])
        scaled[: len(gauge), : len(gauge)] += free @ free.T
    return scale, CholeskyRoot.of(scaled)
