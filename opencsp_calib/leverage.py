"""How many jackknife sigmas hold the truth where views are few and of unequal weight: not Student's t of V - 1.

Theory tells it of linear clusters whose noise is independent (Bell and McCaffrey, "Bias reduction in standard errors
for linear regression with multi-stage samples", 2002). Let d_v be by how much the variance of the camera in some
direction grows without view v of V, all else marginalised, in units of that by all views. Then the jackknife's variance
in that direction is distributed as a sum of squares, each view giving (V - 1)/V degrees of freedom times d_v. In the
mean it is ``(V - 1)/V sum d_v``, which is too large: 1.3 times with ten views of a flat board, 1.9 times where its
shape is solved for. And it scatters more than that of V - 1 equal views, the more the fewer views decide.

With a flat board the two make up for each other within a few per cent. Where the board's shape is solved for from few
views they do not. A sigma is stated for Student's t of V - 1 degrees of freedom, so it is the jackknife's times the
number of its sigmas that hold 95 % by this theory, over Student's t. Of that number the mean over the principal
directions is taken: it differs little between them, and one number keeps the form of the covariance.
"""

from typing import NamedTuple

import numpy as np

from opencsp_calib.arrays import Floats, Matrix
from opencsp_calib.jacobian import CORNER, ViewRows
from opencsp_calib.normal_equations import NormalEquations
from opencsp_calib.schur import Factorisation

__all__ = ["growth_without_each_view", "jackknife_correction", "sigmas_that_hold"]

MISSED = 0.05  # of the truth, by the intervals that are to hold what they say; at other confidences they nearly do
NODES = 32  # of the integral: nine digits
HALVINGS = 36  # of where the number of sigmas may be: nine digits
TOGETHER = 2**20  # numbers: of as many views at once right-hand sides are solved for as have so many
ROUNDING = 1e-10  # of the largest: directions in which a view has no more part than this


def jackknife_correction(whole: Factorisation) -> float:
    """What to multiply jackknife sigmas by, so that Student's t of V - 1 degrees of freedom holds what it says.

    Parameters
    ----------
    whole : Factorisation
        As `growth_without_each_view` takes it.
    """
    growth = growth_without_each_view(whole)
    _, directions = np.linalg.eigh(growth.sum(axis=0))
    along = np.einsum("pi,vpq,qi->iv", directions, growth, directions)
    equal = np.full((1, len(growth)), 1.0 / (len(growth) - 1))  # whose number is Student's t
    *unequal, student = sigmas_that_hold(np.concatenate([along, equal]))
    return float(np.mean(unequal) / student)


def sigmas_that_hold(along: Floats) -> Floats:
    """(Q,) how many jackknife sigmas miss the truth as often as is allowed.

    By Craig's form of the normal distribution's tail, an integral over an angle of exponentials of its square: the mean
    of such an exponential over a sum of squares is a product.

    Parameters
    ----------
    along : (Q, V)
        By how much the variance in each direction grows without each view.
    """
    nodes, weights = np.polynomial.legendre.leggauss(NODES)
    squares = np.sin(0.25 * np.pi * (nodes + 1.0)) ** 2
    half_dof = 0.5 * (1.0 - 1.0 / along.shape[1])
    few, many = np.full(len(along), 1e-4), np.full(len(along), 1e4)
    for _ in range(HALVINGS):
        middle = np.sqrt(few * many)
        raised = (middle**2)[:, None, None] / squares[:, None] * along[:, None]
        missed = 0.5 * np.exp(-half_dof * np.log1p(raised).sum(axis=2)) @ weights
        few, many = np.where(missed > MISSED, middle, few), np.where(missed > MISSED, many, middle)
    return np.asarray(np.sqrt(few * many))


def growth_without_each_view(whole: Factorisation) -> Floats:
    """(V, Q, Q) by how much the camera's covariance grows without each view, in units of that by all views.

    Where the board's shape is free, the information is taken in the 2 Q directions that the camera's unknowns and the
    view's part in them span, which is two steps of block conjugate gradients: of ten views 1 or 2 % stay open.

    Parameters
    ----------
    whole : Factorisation
        Of all views, not damped; no view is to be the only one that determines something.
    """
    equations = whole.equations
    cameras = equations.unknowns.camera.shape[1]
    root = np.linalg.cholesky(whole.shared_covariance[:cameras, :cameras])
    whitening = np.asarray(np.linalg.inv(root), dtype=np.float64)
    if not len(equations.unknowns.corners):
        return _directly(equations, whitening)
    camera = np.zeros((equations.unknowns.shared + CORNER * len(equations.unknowns.corners), cameras))
    camera[:cameras] = whitening.T
    moved = whole.solve_without_poses(camera)  # of unit covariance
    together = max(1, TOGETHER // camera.size)
    views = len(equations.pose)
    runs = [(begin, min(begin + together, views)) for begin in range(0, views, together)]
    return np.concatenate([_in_two_steps(whole, moved, run) for run in runs])


def _directly(equations: NormalEquations, whitening: Matrix) -> Floats:
    """(V, Q, Q) where no corner is solved for."""
    turned = equations.shared_pose.transpose(0, 2, 1)
    information = equations.shared - equations.shared_pose @ np.linalg.solve(equations.pose, turned)
    rest = information.sum(axis=0) - information
    scale = 1.0 / np.sqrt(np.diagonal(rest, axis1=1, axis2=2))
    inverse = scale[:, :, None] * np.linalg.inv(scale[:, :, None] * rest * scale[:, None]) * scale[:, None]
    cameras = len(whitening)
    return np.asarray(whitening @ inverse[:, :cameras, :cameras] @ whitening.T - np.eye(cameras))


def _in_two_steps(whole: Factorisation, moved: Floats, views: tuple[int, int]) -> Floats:
    """(n, Q, Q) of a run of views. Steps X of all unknowns (M + 3 C, Q) move the camera by one sigma each.

    With A the information of all views and A_v of one, it is the inverse of A - A_v among X and U = A⁻¹A_v X - X m.
    """
    equations, size = whole.equations, moved.shape[1]
    shared, corners = equations.unknowns.shared, len(equations.unknowns.corners)
    run = [_View(rows, np.linalg.inv(equations.pose[rows.view])) for rows in equations.rows(*views, together=True)]
    seen = [view.seen(moved, shared) for view in run]
    asked = np.stack([view.back(one, shared, corners) for view, one in zip(run, seen, strict=True)], axis=1)
    answer = whole.solve_without_poses(asked.reshape(len(moved), -1)).reshape(asked.shape)
    growth = np.empty((len(run), size, size))
    for index, (view, first) in enumerate(zip(run, seen, strict=True)):
        part = first.T @ first
        second = view.seen(answer[:, index], shared) - first @ part
        crossed = first.T @ second
        open_still = np.linalg.pinv(crossed - second.T @ second, rcond=ROUNDING, hermitian=True)
        growth[index] = np.linalg.inv(np.eye(size) - part - crossed @ open_still @ crossed) - np.eye(size)
    return growth


class _View(NamedTuple):
    """Rows of J of a view, and the inverse of its pose's information (6, 6)."""

    rows: ViewRows
    inverse_pose: Matrix

    def seen(self, moved: Floats, shared: int) -> Matrix:
        """(2 n, R) how residuals change with steps (M + 3 C, R), the pose following."""
        rows, steps = self.rows, moved.shape[1]
        corners = moved[shared:].reshape(CORNER, -1, steps)[:, rows.columns]
        change = rows.shared.transpose(0, 2, 1) @ moved[:shared] + np.einsum("ain,inr->anr", rows.corner, corners)
        followed = self.inverse_pose @ (rows.pose @ change).sum(axis=0)
        return np.asarray(change - rows.pose.transpose(0, 2, 1) @ followed).reshape(-1, steps)

    def back(self, change: Matrix, shared: int, corners: int) -> Floats:
        """(M + 3 C, R) derivatives, transposed, times changes (2 n, R) as `seen`."""
        rows, by_axis = self.rows, change.reshape(2, -1, change.shape[1])
        product = np.zeros((shared + CORNER * corners, change.shape[1]))
        product[:shared] = (rows.shared @ by_axis).sum(axis=0)
        product[shared:].reshape(CORNER, corners, -1)[:, rows.columns] = np.einsum("ain,anr->inr", rows.corner, by_axis)
        return product
