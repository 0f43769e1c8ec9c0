"""What it costs to solve for the shape of a board that is flat.

Claim
    Errors with the board's shape free are at most 1.1 times as much larger than errors with the board flat as the
    covariances say they must be, in the mean of fx, fy, cx, cy and projections (one ratio of 100 worlds is known to
    about 7 %, one sigma).

Way
    The seed's procedure (demo camera, 22 x 19 corners, half of the views turned), 100 worlds at each number of views,
    each with other poses and independent noise of 0.1 px a corner and axis; bundle, equal weights. "Errors" are rms
    over the worlds of solved minus true; "bound" the same of the sigmas by residuals, times the true noise over the
    residuals', so that it is the Cramér-Rao bound; "cost" is errors free over flat, and its bound likewise.
    Projections: over the image (40 x 30 points), after the change of frame that fits best, rms over points.

Run ``python validation/bench.py bundle_flat_board``.
"""

import sys

import numpy as np

from opencsp_calib import Calibration, Checkerboard, SolveOptions
from opencsp_calib.arrays import Floats
from opencsp_calib.comparison import compare
from opencsp_calib.normal_equations import normal_equations
from opencsp_calib.projection_sigma import Alignment
from opencsp_calib.registry import installed
from opencsp_calib.schur import factorise
from opencsp_calib.synthetic import demo_camera, observe, seed_poses

BOARD = Checkerboard(22, 19, 0.05)
CAMERA = demo_camera()
NOISE_PX = 0.1
WORLDS = 100
NAMES = ("fx", "fy", "cx", "cy", "projections")


def errors_and_bounds(calibration: Calibration) -> tuple[Floats, Floats]:
    """Of fx, fy, cx, cy and projections (length, rms over the image), px."""
    covariance = NOISE_PX**2 * factorise(normal_equations(calibration)).camera_covariance
    jacobian = Alignment.at_infinity(CAMERA).grid_jacobian  # (N, 2, P)
    projected = np.einsum("nip,pq,niq->n", jacobian, covariance, jacobian).mean() ** 0.5
    difference = compare(CAMERA, calibration.camera).rms_px
    error = np.append((calibration.camera.params - CAMERA.params)[:4], difference)
    return error, np.append(np.sqrt(np.diag(covariance)[:4]), projected)


def main() -> None:
    """Print the table."""
    solver = installed().solver("bundle")
    print("\n| views | what | error flat | bound flat | error free | bound free | cost | its bound | ratio |")
    print("|---|---|---|---|---|---|---|---|---|")
    for views in (10, 20, 50):
        found = []
        for world in range(WORLDS):
            seen = observe(CAMERA, BOARD, seed_poses(BOARD, CAMERA, views, world), noise_px=NOISE_PX, rng=1000 + world)
            shapes = (solver.solve(seen, "opencv4", SolveOptions(board_shape=shape)) for shape in ("flat", "free"))
            found.append([errors_and_bounds(calibration) for calibration in shapes])
            print(f"\r{views} views, world {world + 1}", end="", file=sys.stderr)
        rms = np.sqrt((np.array(found) ** 2).mean(axis=0))  # (flat or free, error or bound, what)
        cost, bound = rms[1, 0] / rms[0, 0], rms[1, 1] / rms[0, 1]
        for k, name in enumerate(NAMES):
            values = " | ".join(f"{v:.4f}" for v in (rms[0, 0, k], rms[0, 1, k], rms[1, 0, k], rms[1, 1, k]))
            print(f"| {views} | {name} | {values} | {cost[k]:.2f} | {bound[k]:.2f} | {cost[k] / bound[k]:.2f} |")
        print(f"| {views} | all, mean | | | | | {cost.mean():.2f} | {bound.mean():.2f} | {(cost / bound).mean():.2f} |")


if __name__ == "__main__":
    main()
