"""The solver ``mrcal``: the optimiser of D. Kogan's calibration toolkit, https://mrcal.secretsauce.net."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from opencsp_calib import Board, Calibration, CalibrationFailedError, InputError, Observations, SolveOptions
from opencsp_calib.arrays import Floats, Mask, checked
from opencsp_calib.convergence import determined
from opencsp_calib.free_board import laid_on_given
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.models import lens_model
from opencsp_calib.rotations import rotation_matrices, rotation_vectors
from opencsp_calib.solving import check_request, finished
from opencsp_calib.unknowns import Estimate
from opencsp_calib_mrcal.process import missing_mrcal, mrcal_version, run_mrcal

__all__ = ["MrcalSolver"]

UNIT = 1e-4
"""Of the board's size, what mrcal is to take for one metre: it stops where a step, of metres and parts of a radian, is
below 1e-6, and 3e-4 px short of the solution, if lengths are about one."""
START_S, VIEW_S = 120.0, 1.0  # patience: mrcal takes about 5 ms a view
STAGES = {
    "pinhole": ("pinhole",),
    "opencv4": ("pinhole", "opencv4"),
    "opencv5": ("pinhole", "opencv5"),
    # without distortion the terms below and above the fraction do the same: from there mrcal goes astray
    "opencv8": ("pinhole", "opencv5", "opencv8"),
    "opencv12": ("pinhole", "opencv5", "opencv12"),
}
EVEN = 1e-9  # of the spacing, to which a board's points must be on the grid to be given as one


@dataclass(frozen=True)
class MrcalSolver:
    """mrcal in its own Python, in another process; without its regularisation.

    An even board is given to it as such; only then can it solve for its warp (two parameters) and reject outliers.
    A measured board, or one as solved, is given as known points before which the camera moves. Weights are by a
    corner's mean sigma, for mrcal knows one number a corner.

    Parameters
    ----------
    timeout_s : float, optional
        After which mrcal is stopped; by default two minutes and a second a view.
    """

    timeout_s: float | None = None

    name = "mrcal"
    models = frozenset(STAGES)
    abilities = frozenset({"guess", "board_warp", "weights", "robust"})

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        return missing_mrcal()

    def version(self) -> str:
        """See `Solver.version`."""
        return mrcal_version()

    def solve(self, observations: Observations, model: str, options: SolveOptions) -> Calibration:
        """See `Solver.solve`."""
        check_request(self, observations, model, options)
        even = _is_even(observations.board)
        if not even and (options.robust or options.board_shape == "warp"):
            what = "rejects outliers" if options.robust else "solves for a warp"
            raise InputError(
                f"mrcal {what} only on an even board, and this one's corners are given as measured; take another "
                "solver, or do without"
            )
        stages = (model,) if options.guess else STAGES[model]
        start = initial_camera(observations, model, options.guess)
        unit = UNIT * float(np.ptp(observations.board.nominal_points, axis=0).max())
        poses = [np.concatenate([p.rotation, p.translation / unit]) for p in initial_poses(start, observations)]
        problem = {
            "lensmodels": np.array([f"LENSMODEL_{name.upper()}" for name in stages]),
            "imagersize": np.array(observations.image_size),
            "intrinsics": start.params,
            "poses": np.array(poses),
            **(_as_grid(observations, options, unit) if even else _as_points(observations, options, unit)),
        }
        timeout_s = self.timeout_s or START_S + VIEW_S * len(poses)
        return self._calibration(observations, model, options, run_mrcal(problem, timeout_s), unit)

    def _calibration(
        self,
        observations: Observations,
        model: str,
        options: SolveOptions,
        solution: Mapping[str, NDArray[Any]],
        unit: float,
    ) -> Calibration:
        board, views = observations.board, len(observations.used)
        columns, rows = board.grid
        poses = _answer(solution, "poses", (views, 6))
        params = _answer(solution, "intrinsics", (len(lens_model(model).parameter_names),))
        rotations, translations = poses[:, :3], poses[:, 3:] * unit
        if options.board_shape == "warp":
            points = _answer(solution, "board", (rows * columns, 3)) * unit
            estimate = Estimate(params, rotation_matrices(rotations), translations, points)
            estimate = laid_on_given(board.points, estimate, np.arange(len(points)))
            board, translations = board.with_points(estimate.points), estimate.translations
            rotations = rotation_vectors(estimate.rotations)
        outliers: list[Mask] | None = None
        if options.robust:
            weights = _answer(solution, "weights", (views, rows, columns)).reshape(views, -1)
            outliers = [w[d.ids] < 0 for w, d in zip(weights, observations.detections, strict=True)]
        return determined(
            finished(
                self, observations, model, options, params, rotations, translations, board=board, outliers=outliers
            )
        )


def _answer(solution: Mapping[str, NDArray[Any]], name: str, shape: tuple[int | None, ...]) -> Floats:
    try:
        return checked(solution[name], f"mrcal's {name}", shape, finite=False)
    except (KeyError, InputError) as error:
        raise CalibrationFailedError(f"mrcal's answer makes no sense: {error}") from None


def _is_even(board: Board) -> bool:
    return bool(np.abs(board.points - board.nominal_points).max() <= EVEN * board.spacing_m)


def _as_grid(observations: Observations, options: SolveOptions, unit: float) -> dict[str, NDArray[Any]]:
    columns, rows = observations.board.grid
    grid = np.zeros((len(observations.used), rows * columns, 3))
    grid[:, :, 2] = -1.0  # not seen
    for seen, detection, weights in zip(grid, observations.detections, _weights(observations, options), strict=True):
        seen[detection.ids, :2] = detection.pixels
        seen[detection.ids, 2] = weights
    return {
        "grid": grid.reshape(-1, rows, columns, 3),
        "spacing": np.array(observations.board.spacing_m / unit),
        "warp": np.array(options.board_shape == "warp"),
        "robust": np.array(options.robust),
    }


def _as_points(observations: Observations, options: SolveOptions, unit: float) -> dict[str, NDArray[Any]]:
    detections, weights = observations.detections, _weights(observations, options)
    seen = [np.column_stack([d.pixels, w]) for d, w in zip(detections, weights, strict=True)]
    indices = [np.column_stack([d.ids, 0 * d.ids, 0 * d.ids + view]) for view, d in enumerate(detections)]
    return {
        "points": observations.board.points / unit,
        "observations": np.concatenate(seen),
        "indices": np.concatenate(indices),
    }


def _weights(observations: Observations, options: SolveOptions) -> list[Floats]:
    """(n,) of every used view: one over the mean sigma, typically 1."""
    detections = observations.detections
    if options.weights == "equal":
        return [np.ones(len(d)) for d in detections]
    weights = [np.linalg.det(np.asarray(d.covariance)) ** -0.25 for d in detections]
    typical = np.median(np.concatenate(weights))
    return [w / typical for w in weights]
