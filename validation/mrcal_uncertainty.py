"""mrcal's own projection uncertainty beside ours, and both beside how far cameras really are from the truth.

Claims
    Where noise is independent, ours from the residuals and ours from leaving out views tell the true error at the
    boards' range to a tenth; mrcal's is 1.4 times as large, since it takes the frame from the mean over the views and
    does not fit it. Where a board flexes, the two that propagate the residuals are four to five times too small,
    mrcal's as much as ours, and the one from leaving out views is right to a tenth.

Way
    Worlds as in ``uncertainty.py``: the demo camera, 12 x 9 corners of 75 mm, 20 views of the seed's procedure,
    opencv4, the board flat; mrcal 2.2 in Debian's Python, without its regularisation, and its
    ``projection_uncertainty`` with the noise it infers from its residuals. Figures are root mean square lengths over
    the image, px, and over the worlds. The frame is fixed by the boards: in mrcal by the mean over the views, in ours
    by the ranges the boards had; errors are aligned as ours are. On Sandia's photographs, of which the truth is not
    known, the frame's error is most of all.

Run ``python validation/bench.py mrcal_uncertainty``: two minutes on an idle machine.
"""

import os
import subprocess
import tempfile
from pathlib import Path

import numpy as np
from _real_data import DATA
from opencsp_calib_mrcal.process import missing_mrcal
from uncertainty import BOARD, CAMERA, NOISE

from opencsp_calib import Calibration, Checkerboard, Observations, SolveOptions, detect
from opencsp_calib.comparison import pixel_grid
from opencsp_calib.projection_sigma import Alignment, board_ranges, sigma_over_range
from opencsp_calib.registry import installed
from opencsp_calib.synthetic import observe, seed_poses
from opencsp_calib.uncertainty import with_uncertainty

VIEWS = 20
WORLDS = 20
FAR_M = 1e6
PYTHON = os.environ.get("OPENCSP_CALIB_MRCAL_PYTHON", "/usr/bin/python3")
IN_MRCALS_PYTHON = """
import sys
import mrcal
import numpy as np

given = dict(np.load(sys.argv[1]))
views = np.arange(len(given["poses"]), dtype=np.int32)
inputs = dict(
    intrinsics=given["intrinsics"][None], extrinsics_rt_fromref=np.zeros((0, 6)), frames_rt_toref=given["poses"],
    points=None, observations_board=given["grid"],
    indices_frame_camintrinsics_camextrinsics=np.column_stack([views, 0 * views, 0 * views - 1]),
    observations_point=None, indices_point_camintrinsics_camextrinsics=None, lensmodel="LENSMODEL_OPENCV4",
    imagersizes=given["imagersize"][None].astype(np.int32), calobject_warp=None,
    calibration_object_spacing=float(given["spacing"]), do_optimize_calobject_warp=False,
    do_apply_outlier_rejection=False, do_apply_regularization=False, do_optimize_intrinsics_core=True,
    do_optimize_intrinsics_distortions=True, do_optimize_frames=True, do_optimize_extrinsics=True, verbose=False,
)
mrcal.optimize(**inputs)
model = mrcal.cameramodel(optimization_inputs=inputs, icam_intrinsics=0)
np.savez(sys.argv[2], covariance=mrcal.projection_uncertainty(given["points"], model, what="covariance"))
"""


def by_mrcal(calibration: Calibration, points: np.ndarray) -> float:
    """The rms length of the error that mrcal expects where the camera sees points (N, 3)."""
    seen = calibration.observations
    columns, rows = seen.board.grid
    grid = np.full((len(seen.used), rows * columns, 3), -1.0)
    for row, detection in zip(grid, seen.detections, strict=True):
        row[detection.ids] = np.column_stack([detection.pixels, np.ones(len(detection))])
    given = {
        "intrinsics": calibration.camera.params,
        "poses": np.array([np.r_[pose.rotation, pose.translation] for pose in calibration.cam_from_board]),
        "grid": grid.reshape(-1, rows, columns, 3),
        "imagersize": np.array(seen.image_size),
        "spacing": np.array(seen.board.spacing_m),
        "points": points,
    }
    environment = {**os.environ, "PYTHONNOUSERSITE": "1"}
    environment.pop("PYTHONPATH", None)
    with tempfile.TemporaryDirectory() as folder:
        problem, answer = Path(folder, "problem.npz"), Path(folder, "answer.npz")
        np.savez(problem, **given)
        subprocess.run([PYTHON, "-c", IN_MRCALS_PYTHON, problem, answer], check=True, env=environment)
        with np.load(answer) as found:
            return float(np.sqrt(np.trace(found["covariance"], axis1=1, axis2=2).mean()))


def figures(calibration: Calibration) -> np.ndarray:
    """(2, 4) at the boards' mean range and far away: the true error, mrcal's, ours by residuals, ours honest."""
    camera, (near, far) = calibration.camera, board_ranges(calibration)
    alignment = Alignment.at_range(camera, *np.linspace(near, far, 5))
    rays = camera.unproject(pixel_grid(camera.image_size, (12, 9)).reshape(-1, 2))
    rows = []
    for distance in ((near + far) / 2, FAR_M):
        off = alignment.jacobian(rays * distance)[0] @ (camera.params - CAMERA.params)
        ours = [
            sigma_over_range(calibration, [distance], covariance=covariance).sigma_px[0]
            for covariance in (calibration.covariance_residual, calibration.covariance)
        ]
        rows.append([np.sqrt((off**2).sum(axis=1).mean()), by_mrcal(calibration, rays * distance), *ours])
    return np.array(rows)


def solved(observations: Observations) -> Calibration:
    """With uncertainty."""
    return with_uncertainty(installed().solver("bundle").solve(observations, "opencv4", SolveOptions()))


def main() -> None:
    """Print the table."""
    if missing_mrcal():
        raise SystemExit(missing_mrcal())
    print("| noise | range | true error | mrcal | ours, residuals | ours, honest |\n|---|---|---|---|---|---|")
    sets = {name: [(noise, seed) for seed in range(WORLDS)] for name, noise in NOISE.items()}
    for name, worlds in sets.items():
        squares = []
        for noise, seed in worlds:
            rng = np.random.default_rng(seed)
            poses = seed_poses(BOARD, CAMERA, VIEWS, rng)
            squares.append(figures(solved(observe(CAMERA, BOARD, poses, rng=rng, **noise))) ** 2)
        print_rows(name, np.sqrt(np.mean(squares, axis=0)))
    seen = detect(DATA / "sandia_checkerboard", Checkerboard(18, 23, 0.05))
    print_rows("Sandia's ten photographs", figures(solved(seen)), known=False)


def print_rows(name: str, found: np.ndarray, *, known: bool = True) -> None:
    """At both ranges."""
    for what, (error, *sigmas) in zip(("the boards'", "infinity"), found, strict=True):
        true = f"{error:.3f}" if known else "?"
        print(f"| {name} | {what} | {true} | {' | '.join(f'{sigma:.3f}' for sigma in sigmas)} |", flush=True)


if __name__ == "__main__":
    main()
