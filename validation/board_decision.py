"""The decision whether to solve for the board's shape: how often it is right, and what it costs.

Claim
    `board_shape.decide` solves for the shape where that makes the camera better, and leaves the board alone where it is
    flat; halves alone, which share the bias of a bent board, do not tell. Deciding costs at most half of a solution
    with the shape, at 50 views.

Way
    Worlds: the demo camera, 12 x 9 corners of 75 mm, a bow of the given height that the solver is not told of, the
    seed's poses and independent noise, equal weights. An error is the rms difference to the true camera over the image,
    frames aligned; root mean squares over 10 worlds. "By halves" and "by the move" are how often each of the two rules
    alone would solve for the shape, "better" how often the solution with it is nearer to the truth. Times are of one
    processor, the quickest of five; what deciding costs is all of `decide` but the solutions.

Run ``python validation/bench.py board_decision``: two minutes.
"""

import time
from dataclasses import replace

import numpy as np
from opencsp_calib_bundle.solver import BundleSolver

from opencsp_calib import Calibration, Checkerboard, Observations, SolveOptions
from opencsp_calib.blas import blas_on_one_thread
from opencsp_calib.board_shape import decide
from opencsp_calib.comparison import compare
from opencsp_calib.shape_evidence import evidence_of
from opencsp_calib.synthetic import bowed, demo_camera, observe, seed_poses
from opencsp_calib.uncertainty import with_uncertainty

BOARD = Checkerboard(12, 9, 0.075)
CAMERA = demo_camera()
WORLDS = 10
VIEWS = (10, 50)
NOISES_PX = (0.02, 0.1)
BOWS_MM = (0.0, 0.1, 0.5, 1.5)
SHAPE = SolveOptions(board_shape="free")


def run(observations: Observations, options: SolveOptions) -> Calibration:
    """By our own solver."""
    return BundleSolver().solve(observations, "opencv4", options)


def world(views: int, noise_px: float, bow_m: float, seed: int, board: Checkerboard = BOARD) -> Observations:
    """A board bowed without the observer's knowledge."""
    poses = seed_poses(board, CAMERA, views, seed)
    return observe(CAMERA, bowed(board, bow_m), poses, noise_px=noise_px, rng=seed, nominal=board)


def one_world(observations: Observations) -> tuple[float, ...]:
    """Errors as given, with the shape, as decided; what halves, the move, and both together say; what is better."""
    given, shaped = run(observations, SolveOptions()), run(observations, SHAPE)
    found = evidence_of(given, SHAPE)
    errors = [compare(c.camera, CAMERA).rms_px for c in (given, shaped)]
    return (*errors, errors[found.for_shape], found.by_halves, found.by_move, found.for_shape, errors[1] < errors[0])


def decision_table() -> None:
    """Over bows, noises and numbers of views."""
    print("\n| views | noise px | bow mm | error as given | with shape | as decided ", end="")
    print("| by halves | by the move | solved | better |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for views in VIEWS:
        for noise_px in NOISES_PX:
            for bow_mm in BOWS_MM:
                rows = [one_world(world(views, noise_px, bow_mm * 1e-3, seed)) for seed in range(WORLDS)]
                errors, rates = np.sqrt(np.mean(np.square(rows), axis=0))[:3], np.mean(rows, axis=0)[3:]
                print(
                    f"| {views} | {noise_px} | {bow_mm} | {errors[0]:.4f} | {errors[1]:.4f} | **{errors[2]:.4f}** | "
                    f"{rates[0]:.0%} | {rates[1]:.0%} | {rates[2]:.0%} | {rates[3]:.0%} |",
                    flush=True,
                )


def cost() -> None:
    """Of deciding, on 50 views of 378 corners."""
    print("| board | weights | as given s | with shape s | deciding s | deciding / with shape |")
    print("|---|---|---|---|---|---|")
    for bow_m in (0.0, 1e-3):
        observations = world(50, 0.05, bow_m, 1, Checkerboard(21, 18, 0.05))
        for options in (SolveOptions(), SolveOptions(weights="covariance", robust=True)):
            times = np.min([times_of(observations, options) for _ in range(5)], axis=0)
            name = "by covariance, robust" if options.robust else "equal"
            board = f"bowed by {bow_m * 1e3:.0f} mm" if bow_m else "flat"
            print(f"| {board} | {name} | {' | '.join(f'{t:.2f}' for t in times)} | {times[2] / times[1]:.2f} |")


def times_of(observations: Observations, options: SolveOptions) -> tuple[float, float, float]:
    """Seconds of the solutions without and with the shape, and of deciding."""
    spent: list[float] = []

    def timed(views: Observations, asked: SolveOptions) -> Calibration:
        begin = time.process_time()
        found = run(views, asked)
        spent.append(time.process_time() - begin)
        return found

    begin = time.process_time()
    decided = decide(observations, options, timed)
    deciding = time.process_time() - begin - sum(spent)
    if len(spent) == 1:
        timed(observations, replace(options, board_shape="free", guess=decided.camera))
    else:  # its uncertainty is needed anyhow
        begin = time.process_time()
        with_uncertainty(replace(decided, covariance=np.full_like(decided.covariance, np.nan)))
        deciding -= time.process_time() - begin
    return spent[0], spent[1], deciding


if __name__ == "__main__":
    with blas_on_one_thread():  # as in the pipeline
        cost()
        decision_table()
