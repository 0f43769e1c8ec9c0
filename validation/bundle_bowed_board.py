"""A board that is not flat, photographed: what the seed's way makes of it, and what is true.

Claim
    From 20 rendered photographs of a board bowed by 1.5 mm, bundle with the board's shape free has fx, fy, cx, cy
    within 0.1 px of truth, an rms under 0.010 px, and the shape within 0.01 mm rms.

Way
    21 x 18 inner corners of 50 mm, poses as the seed asks for them (half of the views turned), the demo camera;
    photographs rendered with noise and blur, found and fitted by the default detection, each world with other poses
    and noise. "Seed's way" is OpenCV's solver on the corners of the same photographs with OpenCV's sub-pixel search.
    Shape: distance of solved corners from true ones after a similarity, rms.

Run ``python validation/bench.py bundle_bowed_board``.
"""

import tempfile
from pathlib import Path

import numpy as np
from _photographs import write_photographs
from scipy.spatial.transform import Rotation

from opencsp_calib import Calibration, Checkerboard, SolveOptions, detect
from opencsp_calib.arrays import Points
from opencsp_calib.comparison import compare
from opencsp_calib.detection import Observations
from opencsp_calib.registry import installed
from opencsp_calib.synthetic import bowed, demo_camera, seed_poses
from opencsp_calib.uncertainty import with_uncertainty

BOARD = Checkerboard(21, 18, 0.05)
CAMERA = demo_camera()
VIEWS, WORLDS = 20, 3
CAREFUL = {"weights": "covariance", "robust": True}
WAYS = {
    "seed's way": ("opencv", "subpix", SolveOptions()),
    "flat": ("bundle", "model", SolveOptions(**CAREFUL)),
    "warp": ("bundle", "model", SolveOptions(board_shape="warp", **CAREFUL)),
    "free": ("bundle", "model", SolveOptions(board_shape="free", **CAREFUL)),
    "free, equal weights": ("bundle", "model", SolveOptions(board_shape="free")),
    "free, square pixels": ("bundle", "model", SolveOptions(board_shape="free", pixel_aspect=1.0, **CAREFUL)),
}


def photographs(folder: Path, bow_m: float, seed: int) -> None:
    """The world's photographs, as files."""
    write_photographs(folder, CAMERA, bowed(BOARD, bow_m), seed_poses(BOARD, CAMERA, VIEWS, seed), 1000 * seed)


def shape_error_mm(solved: Points, truth: Points) -> float:
    """Rms distance, mm, after the similarity that fits best."""
    a, b = solved - solved.mean(axis=0), truth - truth.mean(axis=0)
    turned = Rotation.align_vectors(b, a)[0].apply(a)
    return 1e3 * float(np.sqrt(((turned * (turned * b).sum() / (turned**2).sum() - b) ** 2).sum(axis=1).mean()))


def row(world: str, way: str, calibration: Calibration, bow_m: float) -> str:
    """One line of the table."""
    error = (calibration.camera.params - CAMERA.params)[:4]
    parameters = " | ".join(f"{e:+.3f} ± {s:.3f}" for e, s in zip(error, calibration.sigma, strict=False))
    shape = shape_error_mm(calibration.board.points, bowed(BOARD, bow_m).points)
    worst = compare(CAMERA, calibration.camera).worst_px
    return f"| {world} | {way} | {calibration.rms_px:.4f} | {parameters} | {worst:.3f} | {shape:.4f} |"


def main() -> None:
    """Print the table."""
    print("\nErrors of fx, fy, cx, cy with their honest sigmas; worst difference by projection, frames aligned.\n")
    print("| world | way | rms px | fx | fy | cx | cy | worst px | shape mm |\n|---|---|---|---|---|---|---|---|---|")
    for seed in range(1, WORLDS + 1):
        for bow_m in (0.0015, 0.0):
            with tempfile.TemporaryDirectory() as folder:
                photographs(Path(folder), bow_m, seed)
                seen: dict[str, Observations] = {
                    refine: detect(folder, BOARD, refine=refine) for refine in ("subpix", "model")
                }
            for way, (solver, refine, options) in WAYS.items():
                calibration = with_uncertainty(installed().solver(solver).solve(seen[refine], "opencv4", options))
                print(row(f"{seed}, bow {1e3 * bow_m:g} mm", way, calibration, bow_m), flush=True)


if __name__ == "__main__":
    main()
