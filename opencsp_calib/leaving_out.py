"""How a camera moves when each view in turn is left out: one Newton step each, everything else solved again."""

from collections.abc import Sequence

import numpy as np

from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.jacobian import CORNER, ViewRows
from opencsp_calib.normal_equations import ROUNDING, NormalEquations
from opencsp_calib.schur import Factorisation

__all__ = ["camera_without_each_view"]

CG_TOLERANCE = 1e-6  # of each step's length in sigmas
CG_STEPS = 200
TOGETHER = 2**14  # numbers: as many views are left out at once as have so many unknowns; more are hardly quicker


def camera_without_each_view(
    whole: Factorisation, *, ahead: Floats | None = None, tolerance: float = CG_TOLERANCE
) -> Floats:
    """How the camera's parameters move when each view in turn is left out.

    Where the board's shape is free, many left-out views are solved for at once by conjugate gradients that start from
    the factor of the whole: one view of many changes little, so few steps are needed.

    Parameters
    ----------
    whole : Factorisation
        Of all views, not damped.
    ahead : (M + 3 C,), optional
        The step that all views together ask for, without poses; none where they are at their minimum.
    tolerance : float
        What may be missing of each step, as a part of its length in sigmas, where it is iterated for.

    Returns
    -------
    (V, P)
        Parameters without the view minus those with it; NaN where the others do not determine them.
    """
    unknowns = whole.equations.unknowns
    if not len(unknowns.corners):
        found = _directly(whole.equations)
        return unknowns.of_camera(found if ahead is None else found - ahead)
    return unknowns.of_camera(_by_iteration(whole, ahead, tolerance))


def _directly(equations: NormalEquations) -> Floats:
    """(V, M): with a small dense matrix for each view; NaN where the other views leave something open."""
    solved = np.linalg.solve(
        equations.pose,
        np.concatenate([equations.shared_pose.transpose(0, 2, 1), equations.pose_gradient[..., None]], axis=2),
    )
    information = equations.shared - equations.shared_pose @ solved[..., :-1]
    gradient = equations.shared_gradient - (equations.shared_pose @ solved[..., -1:])[..., 0]
    rest, rest_gradient = information.sum(axis=0) - information, gradient.sum(axis=0) - gradient
    diagonal = np.diagonal(rest, axis1=1, axis2=2)
    scale = 1.0 / np.sqrt(np.where(diagonal > 0, diagonal, np.inf))
    sizes, directions = np.linalg.eigh(scale[:, :, None] * rest * scale[:, None])
    along = directions.transpose(0, 2, 1) @ (scale * rest_gradient)[:, :, None]
    known = sizes > ROUNDING
    along = np.divide(along[:, :, 0], sizes, out=np.full(sizes.shape, np.nan), where=known)
    return np.asarray(-scale * (directions @ along[:, :, None])[:, :, 0])


def _by_iteration(whole: Factorisation, ahead: Floats | None, tolerance: float) -> Floats:
    """(V, M); see `_without`."""
    unknowns = whole.equations.unknowns
    inverse_pose = np.asarray(np.linalg.inv(whole.equations.pose), dtype=np.float64)
    views, size = len(inverse_pose), unknowns.shared + CORNER * len(unknowns.corners)
    together = max(1, TOGETHER // size)
    runs = [(begin, min(begin + together, views)) for begin in range(0, views, together)]
    moves = (_without(whole, inverse_pose, run, ahead, tolerance)[:, : unknowns.shared].copy() for run in runs)
    return np.concatenate(list(moves))  # without the copies all that the corners move by would be kept until here


def _without(
    whole: Factorisation, inverse_pose: Floats, views: tuple[int, int], ahead: Floats | None, tolerance: float
) -> Floats:
    """(n, M + 3 C) of a run of views: preconditioned conjugate gradients on S - S_v, S being factored, S_v of one view.

    Both with the poses eliminated. The product of S with the search direction follows from the recurrence, so S itself
    is never needed. Both are singular in the directions of the gauge, which right-hand sides have no part in. Steps
    are counted from where the step `ahead` (M + 3 C,) leads.
    """
    equations, inverse_pose = whole.equations, inverse_pose[slice(*views)]
    run = tuple(equations.rows(*views, together=True))
    start_from = None if ahead is None else np.broadcast_to(ahead, (len(run), len(ahead)))
    right = _of_views(equations, run, inverse_pose, start_from, residual=True)
    x, residual = np.zeros_like(right), right.copy()
    direction, whole_direction = np.zeros_like(right), np.zeros_like(right)
    before = np.ones(len(right))
    for step in range(CG_STEPS):
        preconditioned = whole.solve_without_poses(residual.T).T
        now = np.einsum("vi,vi->v", residual, preconditioned)
        if step == 0:
            start = now.copy()
        active = now > tolerance**2 * start
        if not active.any():
            break
        factor = np.where(active, now / before, 0.0) if step else np.zeros_like(now)
        direction = preconditioned + factor[:, None] * direction
        whole_direction = residual + factor[:, None] * whole_direction
        product = whole_direction - _of_views(equations, run, inverse_pose, direction)
        curvature = np.einsum("vi,vi->v", direction, product)
        length = np.divide(now, curvature, out=np.zeros_like(now), where=active & (curvature > 0))
        x += length[:, None] * direction
        residual -= length[:, None] * product
        before = np.where(active, now, 1.0)
    x[active] = np.nan
    return x


def _of_views(
    equations: NormalEquations,
    run: Sequence[ViewRows],
    inverse_pose: Floats,
    x: Floats | None,
    *,
    residual: bool = False,
) -> Floats:
    """(n, M + 3 C): each view's own matrix, its pose eliminated, times a vector of its own, or plus its gradient."""
    shared, corners = equations.unknowns.shared, len(equations.unknowns.corners)
    products = np.zeros((len(run), shared + CORNER * corners))
    for index, rows in enumerate(run):
        moved = rows.residual if residual else np.zeros_like(rows.residual)
        if x is not None:
            moved = moved + _moved(rows, x[index], shared)
        turned = (rows.pose @ moved[:, :, None]).sum(axis=0)[:, 0]
        moved = moved - (inverse_pose[index] @ turned) @ rows.pose
        products[index, :shared] = (rows.shared @ moved[:, :, None]).sum(axis=0)[:, 0]
        of_corners = products[index, shared:].reshape(CORNER, corners)
        of_corners[:, rows.columns] = (rows.corner * moved[:, None]).sum(axis=0)
    return products


def _moved(rows: ViewRows, x: Floats, shared: int) -> Matrix:
    """(2, n) by how much a view's residuals change with a step of the shared unknowns and the corners."""
    corners = x[shared:].reshape(CORNER, -1)[:, rows.columns]
    return np.asarray(x[:shared] @ rows.shared + (rows.corner * corners).sum(axis=1))
