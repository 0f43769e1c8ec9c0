"""Sandia's ten photographs: what the board's shape does, judged by views that were not used.

Claim
    With fitted corners, the board's shape free and square pixels the rms is at most 0.0155 px (flat 0.185). Trained on
    002, 004, 006, 008 and 010, with nothing but the poses of the others fitted, theirs is at most 0.018 px; the other
    way round at most 0.029.

Way
    Default detection (18 x 23 corners, squares taken as 50 mm), solver bundle, model opencv4. "Halves" is how far the
    two halves' cameras are apart over the image, frames aligned. Sigmas: honest (jackknife) and by the residuals.
    Spacing: the board's in y over that in x, as solved; shear: how far its axes are from square; both from the affine
    map that fits best. Height: peak to valley out of the board's plane.

Run ``python validation/bench.py bundle_sandia``.
"""

import numpy as np
from _real_data import DATA

from opencsp_calib import Calibration, Checkerboard, SolveOptions, detect
from opencsp_calib.comparison import compare
from opencsp_calib.detection import Observations
from opencsp_calib.registry import installed
from opencsp_calib.resampling import held_out
from opencsp_calib.uncertainty import with_uncertainty

BOARD = Checkerboard(18, 23, 0.05)
EVEN = [f"{n:03}.png" for n in (2, 4, 6, 8, 10)]
ODD = [f"{n:03}.png" for n in (1, 3, 5, 7, 9)]
WEIGHTED = {"equal": {}, "covariance, robust": {"weights": "covariance", "robust": True}}
SHAPES = (("flat", None), ("flat", 1.0), ("warp", None), ("warp", 1.0), ("free", None), ("free", 1.0))


def board_words(calibration: Calibration) -> str:
    """Spacing, shear and height of the board as solved."""
    solved = calibration.board.points - calibration.board.points.mean(axis=0)
    nominal = BOARD.nominal_points - BOARD.nominal_points.mean(axis=0)
    affine = np.linalg.lstsq(nominal[:, :2], solved, rcond=None)[0]
    spacing = np.linalg.norm(affine[1]) / np.linalg.norm(affine[0])
    height = solved - nominal[:, :2] @ affine
    return f"{spacing:.5f} | {1e3 * (affine[0] @ affine[1]):+.2f} | {1e3 * np.ptp(height[:, 2]):.2f}"


def row(observations: Observations, options: SolveOptions, weighting: str) -> str:
    """One line of the table."""
    solver = installed().solver("bundle")

    def solve(seen: Observations) -> Calibration:
        return solver.solve(seen, "opencv4", options)

    calibration = with_uncertainty(solve(observations))
    even, odd = observations.keeping(EVEN), observations.keeping(ODD)
    by_residuals = np.sqrt(np.diag(calibration.covariance_residual))
    numbers = zip(calibration.camera.params[:4], calibration.sigma, by_residuals, strict=False)
    params = " | ".join(f"{value:.2f} ± {honest:.2f} ({residual:.2f})" for value, honest, residual in numbers)
    outside = [held_out((pair,), solve).rms_px for pair in ((even, odd), (odd, even))]
    halves = compare(solve(even).camera, solve(odd).camera)
    pixels = "free" if options.pixel_aspect is None else "square"
    return (
        f"| {weighting} | {options.board_shape} | {pixels} | {calibration.rms_px:.4f} | {calibration.rejected_corners} "
        f"| {outside[0]:.4f} | {outside[1]:.4f} | {halves.median_px:.2f}, {halves.worst_px:.2f} | {params} "
        f"| {board_words(calibration)} |"
    )


def main() -> None:
    """Print the table."""
    observations = detect(DATA / "sandia_checkerboard" / "*.png", BOARD)
    print("\n| weights | board | pixels | rms px | rejected | others' rms, from even | from odd ", end="")
    print("| halves: median, worst px | fx | fy | cx | cy | spacing y/x | shear mrad | height mm |")
    print("|---" * 15 + "|")
    for weighting, chosen in WEIGHTED.items():
        for shape, aspect in SHAPES:
            print(
                row(observations, SolveOptions(board_shape=shape, pixel_aspect=aspect, **chosen), weighting), flush=True
            )


if __name__ == "__main__":
    main()
