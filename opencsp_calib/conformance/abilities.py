"""Promises of a solver's abilities: what it says that it can do, it does."""

from dataclasses import replace

import numpy as np

from opencsp_calib.arrays import Mask
from opencsp_calib.comparison import compare
from opencsp_calib.conformance.kit import Promise, Setup, promise
from opencsp_calib.conformance.solvers import EXACT_PX, found
from opencsp_calib.conformance.worlds import BOARD, World, edited, main_model, world
from opencsp_calib.detection import Detection
from opencsp_calib.interfaces import Solver
from opencsp_calib.options import SolveOptions
from opencsp_calib.synthetic import bowed

__all__ = ["CHECKS"]

BOW_M = 1.5e-3
NOISE_PX = 0.1
SPOILT_PX = 12.0
NEAR_PX = 0.3  # some sigmas of a camera from these worlds' noise; a spoilt corner in fifty moves it by pixels


def starts_from_a_guess(solver: Solver, setup: Setup) -> None:
    """A guess of the same or of another lens model is taken, and does not change where it ends."""
    exact = world(main_model(solver))
    rough = replace(exact.camera, params=exact.camera.params * 1.02)
    simple = replace(exact.camera, model="pinhole", params=exact.camera.params[:4] * 0.97)
    for guess in (rough, simple):
        worst = compare(exact.camera, found(solver, exact, SolveOptions(guess=guess)).camera).worst_px
        promise(worst <= EXACT_PX, f"with a guess ({guess.model}) its camera differs by {worst:.3g} px")


def holds_the_pixel_aspect(solver: Solver, setup: Setup) -> None:
    """fy/fx is what was asked for, whatever the data say."""
    params = found(solver, world(main_model(solver), noise_px=NOISE_PX), SolveOptions(pixel_aspect=1.0)).camera.params
    promise(abs(params[1] / params[0] - 1.0) < 1e-9, f"asked for fy/fx = 1, it has {params[1] / params[0]}")


def weighs_corners_by_their_covariance(solver: Solver, setup: Setup) -> None:
    """Corners that are far off and say so do not matter."""
    spoilt = _spoilt(world(main_model(solver), noise_px=NOISE_PX))
    plain, weighted = (
        compare(spoilt.camera, found(solver, spoilt, options).camera).rms_px
        for options in (SolveOptions(), SolveOptions(weights="covariance"))
    )
    promise(
        weighted < min(NEAR_PX, 0.5 * plain),
        f"corners {SPOILT_PX:g} px off, with covariances that say so, put its camera off by {weighted:.3g} px "
        f"({plain:.3g} px without weights)",
    )


def leaves_out_outliers(solver: Solver, setup: Setup) -> None:
    """Corners that are far off are marked as outliers, others are not, and the camera is as if they were not there."""
    spoilt = _spoilt(world(main_model(solver), noise_px=NOISE_PX))
    calibration = found(solver, spoilt, SolveOptions(robust=True))
    pairs = list(zip(calibration.outliers, map(_is_spoilt, spoilt.observations.detections), strict=True))
    missed = sum(int((bad & ~out).sum()) for out, bad in pairs)
    wrongly = sum(int((out & ~bad).sum()) for out, bad in pairs)
    corners = sum(len(out) for out, _ in pairs)
    promise(missed == 0, f"{missed} corners that are {SPOILT_PX:g} px off are not marked as outliers")
    promise(wrongly < 0.02 * corners, f"{wrongly} of {corners} good corners are marked as outliers")
    worst = compare(spoilt.camera, calibration.camera).rms_px
    promise(worst < NEAR_PX, f"with outliers left out, its camera is off by {worst:.3g} px rms")


def finds_a_warp(solver: Solver, setup: Setup) -> None:
    """A bowed board given as flat: its bow is found by the few terms of a warp, the camera as if it were known."""
    _promise_shape(solver, "warp")


def finds_the_shape(solver: Solver, setup: Setup) -> None:
    """The same with every corner of the board free."""
    _promise_shape(solver, "free")


def _promise_shape(solver: Solver, shape: str) -> None:
    truth = bowed(BOARD, BOW_M)
    seen = world(main_model(solver), truth=truth, given=BOARD)
    calibration = found(solver, seen, SolveOptions(board_shape=shape))  # type: ignore[arg-type]  # one of its words
    worst = compare(seen.camera, calibration.camera).worst_px
    promise(worst <= EXACT_PX, f"on a board bowed by {BOW_M * 1e3:g} mm its camera differs by {worst:.3g} px")
    shift = calibration.board.points - BOARD.points
    middle = BOARD.points - BOARD.points.mean(axis=0)
    slack = 1e-3 * BOW_M  # of the seven conditions: at first order in the shift or exactly, as each solver likes
    promise(np.abs(shift.mean(axis=0)).max() < slack, "the board as solved is shifted against the nominal one")
    extent = float((middle**2).sum())
    turn, stretch = np.cross(middle, shift).sum(axis=0) / extent, float((middle * shift).sum()) / extent
    promise(np.abs(turn).max() < 1e-6, "the board as solved is turned against the nominal one")
    promise(abs(stretch) < 1e-5, "the board as solved is stretched against the nominal one")
    off = np.abs(shift[:, 2] - (truth.points[:, 2] - truth.points[:, 2].mean())).max()
    promise(off < 0.02 * BOW_M, f"the shape of its board is off by {off * 1e3:.3g} mm of {BOW_M * 1e3:g} mm")


def _spoilt(clean: World) -> World:
    """The same with one corner in fifty moved by `SPOILT_PX`, with a covariance that says so."""

    def spoil(number: int, seen: Detection) -> Detection:
        bad = _is_spoilt(seen)
        directions = np.random.default_rng(number).normal(size=seen.pixels.shape)
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        directions += [0.7, 0.0]  # all the same way, rather, so that they do harm
        sigma = np.where(bad, 10.0 * SPOILT_PX, NOISE_PX)
        pixels = seen.pixels + SPOILT_PX * bad[:, None] * directions
        return replace(seen, pixels=pixels, covariance=sigma[:, None, None] ** 2 * np.eye(2))

    return clean.seen_as(edited(clean.observations, spoil))


def _is_spoilt(seen: Detection) -> Mask:
    return np.asarray(seen.ids % 50 == 13)


CHECKS: dict[str, Promise] = {
    "guess": starts_from_a_guess,
    "pixel_aspect": holds_the_pixel_aspect,
    "weights": weighs_corners_by_their_covariance,
    "robust": leaves_out_outliers,
    "board_warp": finds_a_warp,
    "board_free": finds_the_shape,
}
"""What each ability promises."""
