"""Levenberg and Marquardt's iteration on the normal equations of a calibration.

Each unknown's damping is in proportion to its diagonal element (Marquardt), so that metres, radians and distortion
coefficients need no common scale; how fast it falls follows from how well the last step's promise was kept (Nielsen,
"Damping parameter in Marquardt's method", 1999).
"""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Matrix, Params
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.models import LensModel
from opencsp_calib.normal_equations import NormalEquations, Parts, linearise, well_conditioned
from opencsp_calib.schur import Factorisation, factorise
from opencsp_calib.unknowns import Estimate, Unknowns
from opencsp_calib.valley import arrived, lowest

__all__ = ["Minimum", "minimise"]

ROUGHLY = 1e-2
"""Tolerance after whose last step next to nothing is left to gain, Newton's steps being what they are: enough between
two weightings."""
NEAR = 1e-8
"""Tolerance as far as unknowns that can hardly be told apart are worth keeping apart."""
TO_THE_END = 1e-16
"""Tolerance after whose last step nothing but rounding is left: the cosine of residuals and any step is below 1e-9."""
ENOUGH = 1e-9  # of the cost left to gain, by a promise: good enough where valleys are too narrow and bent to follow
EXACT_PX = 1e-11  # where steps change residuals by less than this, it is rounding, however small the cost
MAX_STEPS = 200
MAX_DAMPING = 1e12
FIRST_DAMPING = 1e-4
LEAST_DAMPING = 1e-16
POLISHES = 8  # steps below what the cost can show: more are noise, where unknowns can hardly be told apart
GROWTH = 10.0  # of the damping after a step that fails, then 20, 40 and so on


@dataclass(frozen=True, eq=False)
class Minimum:
    """Where the iteration ended.

    Parameters
    ----------
    estimate : Estimate
    equations : NormalEquations
        At the estimate, or so near that they do not differ.
    converged : bool
    factor : Factorisation, optional
        Of the equations; None where there is none that is not damped.
    """

    estimate: Estimate
    equations: NormalEquations
    converged: bool
    factor: Factorisation | None = None


@dataclass(frozen=True, eq=False)
class _Step:
    """A step of the unknowns, how much it promises to lower the cost, and the factored matrix it comes from."""

    parts: Parts
    promised: float
    factor: Factorisation


def minimise(
    lens: LensModel, table: CornerTable, start: Estimate, unknowns: Unknowns, *, roughly: bool = False
) -> Minimum:
    """The least sum of squared whitened residuals.

    Parameters
    ----------
    lens : LensModel
    table : CornerTable
    start : Estimate
        One that sees every corner; unless `roughly`, almost the minimum.
    unknowns : Unknowns
    roughly : bool
        From further away, and only until steps hardly matter.

    Returns
    -------
    Minimum
        Not converged where no step lowers the cost any more, or after too many.
    """
    here = linearise(lens, table, start, unknowns)
    if roughly:
        return _descended(lens, table, start, here, ROUGHLY, FIRST_DAMPING)
    if well_conditioned(here) is unknowns:
        return _descended(lens, table, start, here, TO_THE_END, LEAST_DAMPING)
    # along a curved valley damping must hold back each unknown, not combinations of them that are alike
    near = _descended(lens, table, start, here, NEAR, NEAR)
    combined = well_conditioned(near.equations)
    end = _along_valley(lens, table, near.estimate, unknowns, combined)
    return end if end.converged else _descended(lens, table, end.estimate, end.equations, TO_THE_END, LEAST_DAMPING)


@dataclass(frozen=True, eq=False)
class _Place:
    """An estimate in a valley, the equations there and Newton's step, by unknowns combined to be told apart.

    Parameters
    ----------
    estimate : Estimate
    equations : NormalEquations
    step : _Step
    combined : (M, M)
        The shared unknowns before they were combined, by those they are combined to.
    """

    estimate: Estimate
    equations: NormalEquations
    step: _Step
    combined: Matrix

    @property
    def cost(self) -> float:
        return self.equations.cost

    @property
    def promised(self) -> float:
        return self.step.promised

    @property
    def triangle(self) -> Matrix:
        """See `opencsp_calib.valley.Place`; by the unknowns as they were, since each is to be held back."""
        root = self.step.factor.shared_root
        left = root @ self.step.parts[0]
        rows = np.linalg.solve(self.combined.T, root.T).T
        return np.asarray(np.linalg.qr(np.pad(np.column_stack([rows, left]), ((0, 1), (0, 0))), mode="r"))

    def after(self, step: Params) -> Estimate:
        """Where a step of the shared unknowns (M,) as they were leads, poses and corners following."""
        parts = self.step.factor.following(np.asarray(np.linalg.solve(self.combined, step), dtype=np.float64))
        return self.estimate.moved(self.equations.unknowns, *parts)


def _along_valley(lens: LensModel, table: CornerTable, near: Estimate, before: Unknowns, unknowns: Unknowns) -> Minimum:
    """The last way, where unknowns can hardly be told apart; see `opencsp_calib.valley`."""
    cameras = before.camera.shape[1]
    combined = np.eye(before.shared)
    combined[:cameras, :cameras] = np.linalg.lstsq(before.camera, unknowns.camera, rcond=None)[0]

    def at(estimate: Estimate) -> _Place | None:
        with np.errstate(all="ignore"):  # as in `_after`
            equations = linearise(lens, table, estimate, unknowns)
            step = _step(equations, LEAST_DAMPING)
        return _Place(estimate, equations, step, combined) if step else None

    start = at(near)
    if start is None:
        return Minimum(near, linearise(lens, table, near, before), converged=False)
    end = lowest(start, lambda here, step: at(here.after(step)), start.cost / start.equations.numbers)
    last = end.estimate.moved(unknowns, *end.step.parts) if arrived(end) else end.estimate
    return Minimum(last, end.equations, end.promised <= ENOUGH * end.cost, end.step.factor)


def _descended(
    lens: LensModel,
    table: CornerTable,
    estimate: Estimate,
    equations: NormalEquations,
    tolerance: float,
    damping: float,
) -> Minimum:
    """Until a step promises to lower the cost by less than the tolerance, as a part of it.

    That step is taken, but the equations are those before it: of so short a step nothing could be seen in them.
    """
    rounding = EXACT_PX * table.typical_weight * len(table) ** 0.5
    growth, fall, polishes = GROWTH, 0.01, 0
    for _ in range(MAX_STEPS):
        step = _step(equations, damping)
        slack = rounding * (2.0 * equations.cost**0.5 + rounding)  # of the cost; below it gains cannot be seen
        least = polishes > POLISHES or (step and step.promised <= max(tolerance * equations.cost, rounding**2))
        if step and least and damping <= FIRST_DAMPING:
            end = estimate.moved(equations.unknowns, *step.parts)
            return Minimum(end, equations, True, step.factor if damping <= LEAST_DAMPING else None)
        there = _after(lens, table, estimate, equations.unknowns, step) if step else None
        if step is None or there is None or not there[1].cost <= equations.cost + slack:  # NaN is not
            damping, growth, fall = damping * growth, growth * 2.0, 0.3
            if damping > MAX_DAMPING:
                break
            continue
        kept = (equations.cost - there[1].cost) / step.promised if step.promised > slack else 1.0
        estimate, equations = there
        polishes += step.promised <= slack
        damping, growth = max(damping * max(fall, 1.0 - (2.0 * kept - 1.0) ** 3), LEAST_DAMPING), GROWTH
    last = _step(equations, LEAST_DAMPING)
    if last is None:
        return Minimum(estimate, equations, converged=False)
    return Minimum(estimate, equations, last.promised <= ENOUGH * equations.cost, last.factor)


def _step(equations: NormalEquations, damping: float) -> _Step | None:
    """None where the damped matrix is still singular."""
    try:
        factor = factorise(equations, damping)
    except np.linalg.LinAlgError:
        return None
    parts = factor.newton_step()
    return _Step(parts, -float(sum((a * b).sum() for a, b in zip(equations.gradient, parts, strict=True))), factor)


def _after(
    lens: LensModel, table: CornerTable, estimate: Estimate, unknowns: Unknowns, step: _Step
) -> tuple[Estimate, NormalEquations]:
    with np.errstate(all="ignore"):  # a wild step may overflow; then the cost is not lower
        moved = estimate.moved(unknowns, *step.parts)
        return moved, linearise(lens, table, moved, unknowns)
