"""Whether a calibration can be believed: solver against solver, half against half, model against model.

All on the same observations, without the corners that the calibration left out as outliers.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, TypeAlias

import numpy as np

from opencsp_calib.calibration import Calibration
from opencsp_calib.comparison import compare
from opencsp_calib.interfaces import Solver
from opencsp_calib.projection_sigma import sigma_map
from opencsp_calib.solver_comparison import (
    AGREE_PX,
    LIKE_WITH_LIKE,
    Pair,
    SolverResult,
    all_solved,
    differences,
    keeping,
    of_known_corners,
)
from opencsp_calib.trials import LADDER, Trials
from opencsp_calib.uncertainty import student_factor

__all__ = ["SENTENCES", "Validation", "ValidationVerdict", "validate"]

ValidationVerdict: TypeAlias = Literal["agree", "disagree", "not compared"]
"""On a calibration: whether solvers agree on it."""
SENTENCES: Mapping[ValidationVerdict, str] = {
    "agree": "The solvers agree.",
    "disagree": "The solvers do not agree: do not use this calibration.",
    "not compared": "The solvers were not compared: fewer than two could run.",
}
"""What each verdict says to people."""
HELD_OUT_REMARK = (
    "the rms of held-out views is nearly blind to wrong intrinsics, because each view's pose is fitted to them: it "
    "tells a wrong board, not a wrong camera"
)


@dataclass(frozen=True, eq=False)
class Validation:
    """What came of it.

    Parameters
    ----------
    calibration : Calibration
        Which was validated, without its outliers.
    solvers : tuple of SolverResult
        Those that could run, by name.
    pairs : tuple of Pair
        Each of them with each other.
    trials : Trials
        Halves, held-out views, lens models, and the other way to take the board.
    reasons : tuple of str
        For people, the most important first.
    """

    calibration: Calibration = field(repr=False)
    solvers: tuple[SolverResult, ...]
    pairs: tuple[Pair, ...]
    trials: Trials
    reasons: tuple[str, ...]

    @property
    def verdict(self) -> ValidationVerdict:
        """Of the solvers; fewer than two that could run prove nothing."""
        if not self.pairs:
            return "not compared"
        return "agree" if all(pair.agree for pair in self.pairs) else "disagree"

    @property
    def predicted_px(self) -> float:
        """The median difference of halves that the honest sigma predicts; NaN where it is not known."""
        return _predicted_halves_px(self.trials)

    def as_json(self) -> dict[str, Any]:
        """What ``validate --json`` prints; what is not known is null."""
        own, other = self.trials.own, self.trials.other_board
        halves = own.halves.difference if own else None
        return {
            "solvers": {result.name: result.as_json() for result in self.solvers},
            "differences": [pair.as_json() for pair in self.pairs],
            "halves": {
                "median_px": halves.median_px if halves else None,
                "worst_px": halves.worst_px if halves else None,
                "predicted_px": self.predicted_px if np.isfinite(self.predicted_px) else None,
            },
            "held_out": {"rms_px": own.held_out.rms_px if own else None},
            "models": [trial.as_json() for trial in (*self.trials.models, *([other] if other else []))],
            "verdict": self.verdict,
            "reasons": list(self.reasons),
        }


def validate(calibration: Calibration, solvers: Mapping[str, Solver], *, models: Sequence[str] = LADDER) -> Validation:
    """Put a calibration to every test there is.

    Parameters
    ----------
    calibration : Calibration
        With its observations; solvers are compared with its board as solved.
    solvers : mapping of str to Solver
        By name. One that is missing, not able, or fails gives a line among the reasons.
    models : sequence of str
        Lens models to try, from the simplest to the richest.
    """
    calibration = keeping(calibration, [~outliers for outliers in calibration.outliers])
    results, left_out = all_solved(calibration, solvers)
    pairs = differences(results)
    trials, with_what = _tried(calibration, solvers, models)
    of_solvers = (*_of_solvers(pairs), *_stopped_short(results), *left_out)
    of_trials = (*_of_halves(trials), *_of_models(trials), *_of_board(trials), *trials.left_out)
    return Validation(calibration, results, pairs, trials, (*of_solvers, *with_what, *of_trials))


def _tried(
    calibration: Calibration, solvers: Mapping[str, Solver], models: Sequence[str]
) -> tuple[Trials, tuple[str, ...]]:
    """With the solver that made the calibration, or the first that can do the same; else more simply, which is said."""
    own, model = calibration.solver.split(" ")[0], calibration.camera.model
    order = sorted(solvers.items(), key=lambda item: (item[0] != own, item[0]))
    here = [solver for _, solver in order if model in solver.models and solver.missing() is None]
    for solver in here:
        if calibration.options.asked <= solver.abilities:
            return Trials.of(calibration, solver, models), ()
    if not here:
        return Trials(), (f"halves and lens models were not tried: no solver here has {model}",)
    held = replace(of_known_corners(calibration), options=LIKE_WITH_LIKE)
    said = f"halves and lens models: no solver here can do all that {own} did; {here[0].name} with the board as solved"
    return Trials.of(held, here[0], models), (f"{said}, equal weights",)


def _of_solvers(pairs: Sequence[Pair]) -> tuple[str, ...]:
    if not pairs:
        return ("install another solver, or name one, to compare with",)
    apart = [pair for pair in pairs if not pair.agree]
    if not apart:
        worst = max(pair.difference.worst_px for pair in pairs)
        return (f"solvers differ nowhere in the image by more than {worst:.1g} px",)
    return tuple(
        f"{pair.a} and {pair.b} differ by up to {pair.difference.worst_px:.2g} px in the image, more than {AGREE_PX:g}"
        for pair in apart
    )


def _stopped_short(results: Sequence[SolverResult]) -> tuple[str, ...]:
    """What explains a difference, or makes agreement worth less."""
    return tuple(p.message for result in results for p in result.calibration.problems if p.code == "not-converged")


def _of_halves(trials: Trials) -> tuple[str, ...]:
    if trials.own is None:
        return ()
    halves, predicted = trials.own.halves.difference, _predicted_halves_px(trials)
    figures = f"{halves.median_px:.2g} px median, {halves.worst_px:.2g} px at worst; {predicted:.2g} px are predicted"
    if halves.median_px > student_factor(len(trials.own.calibration.cam_from_board)) * predicted:
        return (f"odd and even views disagree by more than the stated sigmas explain: {figures}", HELD_OUT_REMARK)
    return (f"odd and even views agree: {figures}", HELD_OUT_REMARK)


def _predicted_halves_px(trials: Trials) -> float:
    """Each half has half of the views, so twice the variance; their difference has twice that again."""
    return 2.0 * float(np.nanmedian(sigma_map(trials.own.calibration).sigma_px)) if trials.own else float("nan")


def _of_models(trials: Trials) -> tuple[str, ...]:
    best = next((trial for trial in trials.models if trial.supported), None)
    if best is None or len(trials.models) < 2:
        return ()
    lines = [f"of the lens models {', '.join(t.model for t in trials.models)} the data support {best.model}"]
    if trials.own and not trials.own.supported:
        signs = "; ".join(trials.own.signs) or f"{best.model} explains unseen views better"
        lines.append(f"the calibration's own model is {trials.own.model}: {signs}")
    return tuple(lines)


def _of_board(trials: Trials) -> tuple[str, ...]:
    if trials.own is None or trials.other_board is None:
        return ()
    flat, shaped = sorted((trials.own, trials.other_board), key=lambda trial: trial.board_shape != "flat")
    apart = compare(flat.calibration.camera, shaped.calibration.camera)
    line = (
        f"solving for the board's shape moves the camera by {apart.rms_px:.2g} px rms ({apart.worst_px:.2g} at worst); "
        f"halves then differ by {shaped.halves.difference.median_px:.2g} px median, with the board as given by "
        f"{flat.halves.difference.median_px:.2g} px; held-out rms {shaped.held_out.rms_px:.3g} and "
        f"{flat.held_out.rms_px:.3g} px"
    )
    return (line,)
