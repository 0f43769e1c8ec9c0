"""Which lens model, and which board, the data support: each tried out on views it has not seen, and on two halves.

rms does not tell: it falls with every parameter added. The rms of held-out views tells a model too poor for the lens,
but once a model is rich enough it hardly moves, because each held-out view's pose is fitted; what a model too rich
loses shows in the halves, which then agree less well.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from opencsp_calib.board_shape import obstacle_to_shape, solve_with_aspect
from opencsp_calib.calibration import Calibration
from opencsp_calib.detection import Observations
from opencsp_calib.interfaces import Solver
from opencsp_calib.judgement import fold_inside
from opencsp_calib.options import SolveOptions
from opencsp_calib.resampling import HalvesDifference, HeldOut, compare_halves, folds, held_out
from opencsp_calib.uncertainty import student_factor, with_uncertainty

__all__ = ["LADDER", "Trial", "Trials", "supported", "try_out"]

LADDER = ("pinhole", "opencv4", "opencv5", "opencv8")
"""Each has the parameters of the one before, and more."""
FOLDS = 5
WORTHWHILE = 0.01  # part of the held-out rms: what explains less is not worth a parameter


@dataclass(frozen=True, eq=False)
class Trial:
    """How one lens model, with the board as given or solved for, does on one set of views.

    Parameters
    ----------
    calibration : Calibration
        From all views, with uncertainty.
    halves : HalvesDifference
    held_out : HeldOut
    signs : tuple of str
        That the model is too rich for the data; empty where there are none, or nothing simpler to hold it against.
    supported : bool
        Whether it is the one that the data support.
    """

    calibration: Calibration = field(repr=False)
    halves: HalvesDifference = field(repr=False)
    held_out: HeldOut
    signs: tuple[str, ...] = ()
    supported: bool = False

    @property
    def model(self) -> str:
        """The lens model's name."""
        return self.calibration.camera.model

    @property
    def board_shape(self) -> str:
        """How the board was solved: as given (``flat``), with a ``warp``, or ``free``."""
        return self.calibration.options.board_shape

    def as_json(self) -> dict[str, Any]:
        """Its figures, for programs."""
        return {
            "model": self.model,
            "board_shape": self.board_shape,
            "rms_px": self.calibration.rms_px,
            "held_out_rms_px": self.held_out.rms_px,
            "halves_rms_px": self.halves.difference.rms_px,
            "halves_worst_px": self.halves.difference.worst_px,
            "supported": self.supported,
            "signs_of_too_rich_a_model": list(self.signs),
        }


@dataclass(frozen=True, eq=False)
class Trials:
    """All that were tried out to judge one calibration.

    Parameters
    ----------
    own : Trial, optional
        Of the calibration's own lens model and board; None where it failed.
    models : tuple of Trial
        With the same board, from the simplest lens model to the richest, the own one among them.
    other_board : Trial, optional
        The own lens model with the board's shape solved for where it was not, and the reverse; None if not possible.
    left_out : tuple of str
        What could not be tried, and why.
    """

    own: Trial | None = None
    models: tuple[Trial, ...] = ()
    other_board: Trial | None = None
    left_out: tuple[str, ...] = ()

    @classmethod
    def of(cls, calibration: Calibration, solver: Solver, models: Sequence[str] = LADDER) -> "Trials":
        """Try out lens models, and the other way to take the board, with one solver."""
        own, options = calibration.camera.model, calibration.options
        left_out: list[str] = []

        def attempt(model: str, options: SolveOptions, *, aspect_given: bool = True) -> Trial | None:
            try:
                return try_out(calibration.observations, model, options, solver, aspect_given=aspect_given)
            except Exception as error:  # a stranger's code: whatever it does must not stop ours
                left_out.append(f"{model} ({options.board_shape} board) could not be tried out: {error}")
                return None

        ladder = models if own in models else (*models, own)
        if own not in LADDER:  # models of another family have nothing in common but their names
            ladder = (own,)
        tried = {model: attempt(model, replace(options, guess=None)) for model in ladder if model in solver.models}
        other = _other_board(calibration, solver)
        other_board = attempt(own, other, aspect_given=False) if other else None
        found = tuple(trial for trial in tried.values() if trial)
        judged = supported(found) if found else ()
        mine = next((trial for trial in judged if trial.model == own), None)
        return cls(mine, judged, other_board, tuple(left_out))


def try_out(
    observations: Observations, model: str, options: SolveOptions, solver: Solver, *, aspect_given: bool
) -> Trial:
    """Solve all views, both halves, and five folds.

    Parameters
    ----------
    observations : Observations
    model : str
    options : SolveOptions
    solver : Solver
    aspect_given : bool
        Otherwise the pixel aspect is decided by all views, as in `solve_with_aspect`, and held for parts of them.

    Raises
    ------
    InputError, CalibrationFailedError
        As the solver; with fewer views than two halves need.
    """

    def run(views: Observations, options: SolveOptions) -> Calibration:
        return solver.solve(views, model, options)

    whole = solve_with_aspect(observations, options, run, aspect_given=aspect_given)
    shaped = whole.options.board_shape == "free"
    guess = whole.camera if "guess" in solver.abilities else None

    def solve(views: Observations) -> Calibration:  # from where the whole ended: a third of the time
        return run(views.with_board(whole.board) if shaped else views, replace(whole.options, guess=guess))

    parts = folds(observations, min(FOLDS, len(observations.used)))
    return Trial(with_uncertainty(whole), compare_halves(observations, solve), held_out(parts, solve))


def supported(trials: Sequence[Trial]) -> tuple[Trial, ...]:
    """Trials of the same views, from the simplest lens model to the richest, with the one that the data support.

    A richer model is taken if it explains views it has not seen better than the best simpler one, by more than they
    scatter (a paired t-test over the views, of the logarithm of their rms) and by `WORTHWHILE`, and if it does not
    lose more in agreement of the halves than it gains.

    Returns
    -------
    tuple of Trial
        The same, with `Trial.signs` and `Trial.supported` filled in.
    """
    best, judged = 0, [trials[0]]
    for index, trial in enumerate(trials[1:], start=1):
        signs = _signs(trials[best], trial)
        judged.append(replace(trial, signs=(*signs, *_weak_signs(trial))))
        if not signs:
            best = index
    judged[best] = replace(judged[best], supported=True)
    return tuple(judged)


def _signs(simple: Trial, rich: Trial) -> tuple[str, ...]:
    """What speaks against taking the richer model."""
    found = []
    gain = np.log(simple.held_out.view_rms_px / rich.held_out.view_rms_px)  # one bad view must not decide
    scatter = student_factor(len(gain)) * gain.std(ddof=1) / np.sqrt(len(gain))
    if not gain.mean() > max(scatter, WORTHWHILE):
        found.append(f"explains views it has not seen no better than {simple.model}")
    before, after = simple.halves.difference.rms_px, rich.halves.difference.rms_px
    if after**2 - before**2 > max(0.0, simple.held_out.rms_px**2 - rich.held_out.rms_px**2):
        found.append(f"halves agree to {after:.2g} px rms only, those of {simple.model} to {before:.2g} px")
    return tuple(found)


def _weak_signs(trial: Trial) -> tuple[str, ...]:
    """What should make one suspicious, but happens to right models too."""
    calibration = trial.calibration
    camera, views = calibration.camera, len(calibration.cam_from_board)
    unclear = np.abs(camera.params) < student_factor(views) * calibration.sigma  # False where sigma is not known
    names = [name for name, is_unclear in zip(camera.lens.parameter_names, unclear, strict=True) if is_unclear]
    found = [f"cannot be told from zero: {', '.join(names)}"] if names else []
    return (*found, *(["the distortion folds back inside the image"] if fold_inside(camera) else []))


def _other_board(calibration: Calibration, solver: Solver) -> SolveOptions | None:
    """The options with the board's shape solved for where it was not, and the reverse; None where there is none."""
    options = calibration.options
    if options.board_shape != "flat":
        return replace(options, board_shape="flat", pixel_aspect=None, guess=None)
    if "board_free" not in solver.abilities or obstacle_to_shape(calibration.observations, calibration):
        return None
    return replace(options, board_shape="free", guess=None)
