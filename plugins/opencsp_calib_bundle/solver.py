"""The solver ``bundle``: everything solved for at once, corners weighted, outliers named, the board's shape too."""

from dataclasses import replace

import numpy as np

from opencsp_calib import Calibration, CalibrationFailedError, Camera, Observations, SolveOptions
from opencsp_calib.arrays import Mask
from opencsp_calib.blas import blas_on_one_thread
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.free_board import laid_on_given, with_lone_corners
from opencsp_calib.jacobian import residuals
from opencsp_calib.models import LENS_MODELS, LensModel
from opencsp_calib.normal_equations import solvable_corners
from opencsp_calib.solving import MIN_CORNERS, check_request, finished
from opencsp_calib.unknowns import Estimate, Unknowns
from opencsp_calib_bundle.covariance import checked_covariance
from opencsp_calib_bundle.levenberg_marquardt import Minimum, minimise
from opencsp_calib_bundle.remarks import remarks
from opencsp_calib_bundle.robust import outlying, weights
from opencsp_calib_bundle.start import start, with_deeper_minima

__all__ = ["BundleSolver"]

ROUNDS = 10  # of weights, then of outliers: they settle in two or three
ROUGH_CORNERS = 4096  # enough to begin with: residuals of all corners tell what is wrong with a few
POOR_PX = 1.0  # where residuals are typically larger, a guess may have led astray
SETTLED = 0.9  # of the scale of the residuals before: when they fall no further, weights have settled


class BundleSolver:
    """Bundle adjustment in NumPy: Levenberg-Marquardt, poses or corners eliminated by Schur complement.

    Every lens model, with or without the pixel aspect held; the board as given, with a smooth warp, or every corner
    of it free. Corners count equally or by their covariance; with the robust option, corners that lie six standard
    deviations out are left out and named, and the rest solved by least squares.
    """

    name = "bundle"
    models = frozenset(LENS_MODELS)
    abilities = frozenset({"board_warp", "board_free", "pixel_aspect", "weights", "robust", "guess"})

    def missing(self) -> str | None:
        """See `Provided.missing`; nothing ever is."""
        return None

    def version(self) -> str:
        """See `Solver.version`; it goes by that of opencsp-calib."""
        from importlib.metadata import version

        return version("opencsp-calib")

    def solve(self, observations: Observations, model: str, options: SolveOptions) -> Calibration:
        """See `Solver.solve`.

        The residual covariance of the camera is filled in; the honest one is for `opencsp_calib.uncertainty`.
        """
        # corners without a covariance are welcome: they count as the typical one of the others
        check_request(self, observations, model, replace(options, weights="equal"))
        with blas_on_one_thread():
            return self._solved(observations, model, options)

    def _solved(self, observations: Observations, model: str, options: SolveOptions) -> Calibration:
        lens, given = LENS_MODELS[model], observations.board.points
        table = CornerTable.of(observations.detections, options.weights)
        estimate = _roughly(observations, model, options, table)
        minimum, outliers = _minimum(observations, lens, options, table, estimate)
        covariance = checked_covariance(observations, lens, options, minimum, table.typical_weight)
        estimate = minimum.estimate
        if options.board_shape == "free":
            estimate = laid_on_given(given, estimate, minimum.equations.unknowns.corners)
            estimate = with_lone_corners(lens, table.keeping(~outliers), estimate)
        calibration = finished(
            self,
            observations,
            model,
            options,
            estimate.params,
            np.array([pose.rotation for pose in estimate.poses]),
            estimate.translations,
            board=observations.board.with_points(estimate.points),
            outliers=table.split(outliers),
        )
        calibration = replace(calibration, covariance_residual=covariance)
        return calibration.with_problems(*remarks(calibration))


def _roughly(observations: Observations, model: str, options: SolveOptions, table: CornerTable) -> Estimate:
    """An estimate near enough to tell outliers from it, with the board as given: from some of the corners.

    From all of them where the camera that some ask for cannot see the others.
    """
    some = table.thinned(ROUGH_CORNERS)
    estimate = _roughly_from(observations, model, options, some)
    if len(some) < len(table) and np.isnan(residuals(LENS_MODELS[model], table, estimate)).any():
        return _roughly_from(observations, model, options, table)
    return estimate


def _roughly_from(observations: Observations, model: str, options: SolveOptions, table: CornerTable) -> Estimate:
    lens = LENS_MODELS[model]
    _, unknowns = _solvable(observations, lens, replace(options, board_shape="flat"), table)

    def from_start(chosen: SolveOptions) -> Estimate:
        return _rough_minimum(lens, table, start(observations, model, chosen, table), unknowns, options.robust)

    def misfit(estimate: Estimate) -> float:
        return float(np.median(np.linalg.norm(residuals(lens, table, estimate), axis=1)))

    estimate = from_start(options)
    if options.guess is not None and misfit(estimate) > POOR_PX:
        estimate = min(estimate, from_start(replace(options, guess=None)), key=misfit)
    camera = Camera("camera", model, estimate.params, observations.image_size)
    return with_deeper_minima(observations, camera, estimate, table)


def _minimum(
    observations: Observations, lens: LensModel, options: SolveOptions, table: CornerTable, estimate: Estimate
) -> tuple[Minimum, Mask]:
    """The least squares of all corners that are no outliers, and (N,) which are."""
    outliers = np.zeros(len(table), dtype=bool)
    solvable, unknowns = _solvable(observations, lens, options, table)
    if options.board_shape != "flat":
        estimate = _rough_minimum(lens, solvable, estimate, unknowns, options.robust)
    if options.robust:
        outliers = _outliers(lens, table, estimate, unknowns, outliers)
    for _ in range(ROUNDS):
        solvable, unknowns = _solvable(observations, lens, options, table.keeping(~outliers))
        minimum = minimise(lens, solvable, estimate, unknowns)
        estimate, before = minimum.estimate, outliers
        if options.robust:
            outliers = _outliers(lens, table, estimate, unknowns, before)
        if np.array_equal(outliers, before):
            break
    return minimum, before


def _rough_minimum(
    lens: LensModel, table: CornerTable, estimate: Estimate, unknowns: Unknowns, robust: bool
) -> Estimate:
    """Near the minimum; if robust, that of Cauchy's weights, which follow the residuals from round to round."""
    if not robust:
        return minimise(lens, table, estimate, unknowns, roughly=True).estimate
    last = np.inf
    for _ in range(ROUNDS):
        factors, scale = weights(table, residuals(lens, table, estimate))
        if scale > SETTLED * last:
            break
        estimate, last = minimise(lens, table.weighted(factors), estimate, unknowns, roughly=True).estimate, scale
    return estimate


def _solvable(
    observations: Observations, lens: LensModel, options: SolveOptions, table: CornerTable
) -> tuple[CornerTable, Unknowns]:
    """What is solved for, and from which corners: where they are solved for one by one, not from those seen once."""
    _check_counts(observations, table, "are outliers: drop it, or check the board's description")
    corners = solvable_corners(table, len(observations.board.points))
    unknowns = Unknowns.of(lens, observations.board, corners, options)
    if options.board_shape == "free":
        table = table.keeping(np.isin(table.ids, corners))
        _check_counts(
            observations, table, "are in no other view, so that they tell nothing of the board's shape: drop it"
        )
    return table, unknowns


def _outliers(lens: LensModel, table: CornerTable, estimate: Estimate, unknowns: Unknowns, before: Mask) -> Mask:
    """(N,); a corner that is left with one view agrees with it, whatever is wrong: of it, the last judgement stays."""
    found = outlying(table, residuals(lens, table, estimate))
    return np.where(np.isin(table.ids, unknowns.corners), found, before) if len(unknowns.corners) else found


def _check_counts(observations: Observations, table: CornerTable, what: str) -> None:
    short = np.flatnonzero(table.counts < MIN_CORNERS)
    if short.size:
        image, left = observations.used[int(short[0])].image, int(table.counts[short[0]])
        raise CalibrationFailedError(f"all but {left} corners of {image} {what}")
