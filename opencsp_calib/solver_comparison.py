"""Solvers held against each other: each solves the same corners, and their cameras are compared.

Like with like: the board as solved held fixed, equal weights, nothing robust, numbers in single precision, which is
what some engines take, so that there is one right answer.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import Any

import numpy as np

from opencsp_calib.arrays import Mask
from opencsp_calib.calibration import Calibration
from opencsp_calib.comparison import Difference, compare
from opencsp_calib.detection import Observations
from opencsp_calib.errors import InputError
from opencsp_calib.interfaces import Solver
from opencsp_calib.options import SolveOptions
from opencsp_calib.resampling import known_corners

__all__ = [
    "AGREE_PX",
    "LIKE_WITH_LIKE",
    "Pair",
    "SolverResult",
    "all_solved",
    "differences",
    "keeping",
    "of_known_corners",
]

AGREE_PX = 1e-3
"""Solvers of the same problem agree to 1e-4 px or better; a thousandth cannot come from rounding."""
LIKE_WITH_LIKE = SolveOptions()
"""Equal weights, nothing robust; and pixels free: the board being held, their aspect is determined."""


@dataclass(frozen=True, eq=False)
class SolverResult:
    """What one solver found.

    Parameters
    ----------
    name, version : str
    calibration : Calibration
    seconds : float
        Wall time, the way of the data to its engine and back included.
    """

    name: str
    version: str
    calibration: Calibration = field(repr=False)
    seconds: float

    def as_json(self) -> dict[str, Any]:
        """Its figures, for programs."""
        camera = self.calibration.camera
        params = dict(zip(camera.lens.parameter_names, camera.params.tolist(), strict=True))
        rms, seconds = self.calibration.rms_px, round(self.seconds, 3)
        return {"version": self.version, "rms_px": rms, "params": params, "seconds": seconds}


@dataclass(frozen=True, eq=False)
class Pair:
    """Two solvers' cameras, compared.

    Parameters
    ----------
    a, b : str
        Names of the solvers.
    difference : Difference
    """

    a: str
    b: str
    difference: Difference = field(repr=False)

    @property
    def agree(self) -> bool:
        """Whether they differ nowhere in the image by more than `AGREE_PX`."""
        return self.difference.worst_px <= AGREE_PX

    def as_json(self) -> dict[str, Any]:
        """Its figures, for programs."""
        worst = self.difference.worst_px
        return {"a": self.a, "b": self.b, "rms_px": self.difference.rms_px, "worst_px": worst, "agree": self.agree}


def all_solved(calibration: Calibration, solvers: Mapping[str, Solver]) -> tuple[tuple[SolverResult, ...], list[str]]:
    """By every solver that can, the board as solved held fixed; and why the others could not."""
    observations = _in_single_precision(of_known_corners(calibration).observations)
    results, left_out = [], []
    for name, solver in sorted(solvers.items()):
        begin = time.perf_counter()
        try:
            missing = solver.missing()
            if missing:
                raise InputError(missing)
            found = solver.solve(observations, calibration.camera.model, LIKE_WITH_LIKE)
            results.append(SolverResult(name, solver.version(), found, time.perf_counter() - begin))
        except Exception as error:  # a stranger's code: whatever it does must not stop ours
            left_out.append(f"the solver {name} was left out: {error}")
    return tuple(results), left_out


def differences(results: Sequence[SolverResult]) -> tuple[Pair, ...]:
    """Each of them with each other."""
    return tuple(
        Pair(a.name, b.name, compare(a.calibration.camera, b.calibration.camera)) for a, b in combinations(results, 2)
    )


def _in_single_precision(observations: Observations) -> Observations:
    """Pixels, and the board in units of its spacing, rounded: some engines take no more, and would round by themselves.

    What rounding does, up to 1e-4 px each, can move the corners of the image by a thousandth of a pixel.
    """
    views = tuple(
        replace(view, detection=replace(view.detection, pixels=view.detection.pixels.astype(np.float32)))
        for view in observations.views
    )
    spacing = observations.board.spacing_m
    points = (observations.board.points / spacing).astype(np.float32).astype(np.float64) * spacing
    return replace(observations, views=views, board=observations.board.with_points(points))


def of_known_corners(calibration: Calibration) -> Calibration:
    """On the board as solved, taken as given; without corners that were not solved for."""
    known = known_corners(calibration)
    kept = keeping(calibration, [known[detection.ids] for detection in calibration.observations.detections])
    return replace(kept, observations=kept.observations.with_board(calibration.board))


def keeping(calibration: Calibration, masks: Sequence[Mask]) -> Calibration:
    """The same, as if of each used view only some corners had been seen."""
    observations = calibration.observations
    chosen = dict(zip((view.image for view in observations.used), masks, strict=True))
    views = tuple(
        replace(view, detection=view.detection.keeping(chosen[view.image])) if view.image in chosen else view
        for view in observations.views
    )
    return replace(
        calibration,
        observations=replace(observations, views=views),
        residuals=tuple(r[mask] for r, mask in zip(calibration.residuals, masks, strict=True)),
        outliers=tuple(o[mask] for o, mask in zip(calibration.outliers, masks, strict=True)),
    )
