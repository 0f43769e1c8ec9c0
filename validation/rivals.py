"""Side by side with the nearest others: mrcal's warp and lensboy 4.0.3, on Sandia's corners and on a bowed board's.

Claim
    A warp of two parameters (mrcal) or five (lensboy) does not explain Sandia's board, whose grid is stretched and
    sheared as well as bent; solving for every corner does, and explains photographs not used seven to eleven times
    better. On a board that is nothing but bowed, where a warp is the right model, every corner free is as near to the
    truth. With the board flat, all three find the same camera.

Way
    The same corners, found by default detection, for all; model opencv4, equal weights, no outliers rejected. Sandia's
    ten photographs; and 20 rendered ones of a 21 x 18 board bowed by 1.5 mm (world 1 of ``bundle_bowed_board.py``).
    "Others' rms": trained on 002, 004, 006, 008 and 010, nothing but the poses of the other five fitted, and the other
    way round. "Halves": their two cameras over the image, frames aligned. Errors: solved minus true. Seconds are of all
    processors together, mrcal's and lensboy's with the start of their Python.

lensboy wants another OpenCV than ours, so that it has an environment of its own (``pip install lensboy==4.0.3``), whose
Python ``LENSBOY_PYTHON`` names; without it, its rows are left out. Run ``python validation/bench.py rivals``.
"""

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from _real_data import DATA
from bundle_bowed_board import BOARD as BOWED_BOARD
from bundle_bowed_board import CAMERA, photographs, shape_error_mm
from bundle_sandia import BOARD as SANDIA_BOARD
from bundle_sandia import EVEN, ODD, board_words

from opencsp_calib import Calibration, Camera, Observations, Pose, SolveOptions, detect
from opencsp_calib.comparison import compare
from opencsp_calib.registry import installed
from opencsp_calib.resampling import held_out
from opencsp_calib.synthetic import bowed

MODEL = "opencv4"
WORKER = """
import sys
import lensboy as lb
import numpy as np

given = np.load(sys.argv[1])
coefficients = np.arange(14) < 4
config = lb.OpenCVConfig(int(given["height"]), int(given["width"]), included_distortion_coefficients=coefficients)
seen = (given["view"] == view for view in range(given["view"].max() + 1))
found = lb.calibrate_camera(
    given["points"], [lb.Frame(given["ids"][v], given["pixels"][v]) for v in seen], config,
    estimate_target_warp=bool(given["warp"]), outlier_threshold_stddevs=None,
)
lens, warp = found.camera_model, found.target_warp
np.savez(
    sys.argv[2], params=[lens.fx, lens.fy, lens.cx, lens.cy, *lens.distortion_coeffs[:4]],
    rotations=[pose.rotvec for pose in found.cameras_from_target],
    translations=[pose.translation for pose in found.cameras_from_target],
    points=warp.warp_target(given["points"]) if warp else given["points"],
)
"""


def lensboy(python: str | None, options: SolveOptions, observations: Observations) -> Calibration:
    """What lensboy makes of it."""
    assert python
    detections = observations.detections
    with tempfile.TemporaryDirectory() as folder:
        given, solved = Path(folder) / "given.npz", Path(folder) / "solved.npz"
        np.savez(
            given,
            view=np.repeat(np.arange(len(detections)), [len(d) for d in detections]),
            ids=np.concatenate([d.ids for d in detections]),
            pixels=np.concatenate([d.pixels for d in detections]),
            points=observations.board.points,
            warp=options.board_shape == "warp",
            width=observations.image_size[0],
            height=observations.image_size[1],
        )
        subprocess.run([python, "-c", WORKER, given, solved], check=True, stdout=sys.stderr)
        found = dict(np.load(solved))
    return Calibration(
        camera=Camera("lensboy", MODEL, found["params"], observations.image_size),
        observations=observations,
        cam_from_board=tuple(Pose(r, t) for r, t in zip(found["rotations"], found["translations"], strict=True)),
        board=observations.board.with_points(found["points"]),
        solver="lensboy",
        options=options,
    )


def ours(solver: str, options: SolveOptions, observations: Observations) -> Calibration:
    """What one of our solvers makes of it."""
    return installed().solver(solver).solve(observations, MODEL, options)


def ways(python: str | None) -> dict[str, Callable[[Observations], Calibration]]:
    """All that are compared."""
    flat, warp, free = (SolveOptions(board_shape=shape) for shape in ("flat", "warp", "free"))
    found = {
        "mrcal, flat": partial(ours, "mrcal", flat),
        "lensboy, flat": partial(lensboy, python, flat),
        "bundle, flat": partial(ours, "bundle", flat),
        "mrcal, its warp (2)": partial(ours, "mrcal", warp),
        "lensboy, its warp (5)": partial(lensboy, python, warp),
        "bundle, our warp (5)": partial(ours, "bundle", warp),
        "bundle, every corner free": partial(ours, "bundle", free),
        "bundle, every corner free, square pixels": partial(
            ours, "bundle", SolveOptions(board_shape="free", pixel_aspect=1.0)
        ),
    }
    return found if python else {name: way for name, way in found.items() if not name.startswith("lensboy")}


def seconds() -> float:
    """Of all processors, of this process and of those it has waited for."""
    return sum(os.times()[:4])


def sandia(python: str | None) -> None:
    """Print Sandia's table."""
    observations = detect(DATA / "sandia_checkerboard" / "*.png", SANDIA_BOARD)
    even, odd = observations.keeping(EVEN), observations.keeping(ODD)
    print("\n### Sandia's ten photographs\n")
    print("| way | rms px | others' rms, from even | from odd | halves: median, worst px | fx | fy | cx | cy ", end="")
    print("| spacing y/x | shear mrad | height mm | seconds |\n" + "|---" * 13 + "|")
    for name, solve in ways(python).items():
        begin = seconds()
        calibration = solve(observations)
        spent = seconds() - begin
        outside = [held_out((pair,), solve).rms_px for pair in ((even, odd), (odd, even))]
        halves = compare(solve(even).camera, solve(odd).camera)
        params = " | ".join(f"{value:.2f}" for value in calibration.camera.params[:4])
        print(
            f"| {name} | {calibration.rms_px:.4f} | {outside[0]:.4f} | {outside[1]:.4f} | {halves.median_px:.2f}, "
            f"{halves.worst_px:.2f} | {params} | {board_words(calibration)} | {spent:.2f} |",
            flush=True,
        )


def bowed_board(python: str | None) -> None:
    """Print the table of the rendered board."""
    with tempfile.TemporaryDirectory() as folder:
        photographs(Path(folder), 0.0015, 1)
        observations = detect(folder, BOWED_BOARD)
    truth = bowed(BOWED_BOARD, 0.0015)
    print("\n### A board bowed by 1.5 mm, 20 rendered photographs: errors\n")
    print("| way | rms px | fx | fy | cx | cy | worst px, aligned | shape mm rms | seconds |\n" + "|---" * 9 + "|")
    for name, solve in ways(python).items():
        begin = seconds()
        calibration = solve(observations)
        spent = seconds() - begin
        errors = " | ".join(f"{error:+.3f}" for error in (calibration.camera.params - CAMERA.params)[:4])
        print(
            f"| {name} | {calibration.rms_px:.4f} | {errors} | {compare(CAMERA, calibration.camera).worst_px:.3f} | "
            f"{shape_error_mm(calibration.board.points, truth.points):.4f} | {spent:.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    sandia(os.environ.get("LENSBOY_PYTHON"))
    bowed_board(os.environ.get("LENSBOY_PYTHON"))
