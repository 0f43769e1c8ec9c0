"""Solvers that check each other: truth found from exact pixels, one minimum from the same observations, and time.

Claims
    From exact pixels mrcal, colmap and bundle find the camera to 1e-6 px by projection, opencv to 5e-5 px. From the
    same noisy observations, the same lens model and equal weights all four differ by at most 1e-4 px anywhere in the
    image, on Sandia's corners (as OpenCSP stored them) and in synthetic worlds, also where the lens has no use for so
    many coefficients.

Way
    The synthetic world is the seed's procedure: the demo camera, 50 views of 22x19 corners at 30 to 45 degrees. "Worst"
    is the largest difference over a grid of 40x30 pixels from edge to edge; the frames are aligned by a rotation only
    where that is said. "Sigmas left" is how far the camera is from the least sum of squares, by our own normal
    equations. OpenCV and COLMAP run on one thread, so that the same run gives the same camera. Times are wall times of
    `Solver.solve`, mrcal's with the start of its Python, the quickest of three.

Run ``python validation/bench.py solvers``.
"""

import time
from itertools import combinations

import h5py
import numpy as np
from _real_data import DATA

from opencsp_calib.board import Checkerboard
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.comparison import compare, pixel_grid
from opencsp_calib.conformance.worlds import camera_of
from opencsp_calib.convergence import remaining_sigmas
from opencsp_calib.detection import Detection, Observations, View
from opencsp_calib.errors import CalibError
from opencsp_calib.options import SolveOptions
from opencsp_calib.registry import installed
from opencsp_calib.synthetic import demo_camera, observe, random_poses, seed_poses

BOARD = Checkerboard(22, 19, 0.05)
SOLVERS = {name: solver for name, solver in installed().solvers.items() if solver.missing() is None}
PLAIN = SolveOptions()
NOISE_PX, FITTED_PX = 0.15, 0.006  # as corners found by OpenCV's search have it, and as fitted ones
REPEATS = 3


def seed_world(views: int, noise_px: float) -> tuple[Camera, Observations]:
    """The seed's procedure, seen with independent noise."""
    camera = demo_camera()
    return camera, observe(camera, BOARD, seed_poses(BOARD, camera, views), noise_px=noise_px, rng=3)


def wide_world(model: str, noise_px: float) -> tuple[Camera, Observations]:
    """The conformance kit's camera, wide enough that every lens model is determined, and 50 views."""
    camera = camera_of(model)
    poses = random_poses(BOARD, camera, 50, 5, tilt_deg=(10.0, 50.0), fill=(0.4, 0.95))
    return camera, observe(camera, BOARD, poses, noise_px=noise_px, rng=3)


def sandia() -> Observations:
    """Sandia's ten photographs, with the corners that OpenCSP has stored."""
    with h5py.File(DATA / "sandia_checkerboard" / "expected_opencsp.h5") as file:
        pixels = file["p_image_points"][()].astype(np.float64)
    views = [View(f"{n:03}.png", Detection(np.arange(414), p.T), "used") for n, p in enumerate(pixels, start=1)]
    return Observations(Checkerboard(18, 23, 0.05), (1626, 1236), tuple(views))


def solutions(observations: Observations, model: str, options: SolveOptions = PLAIN) -> dict[str, Calibration]:
    """What every solver that is able to makes of them."""
    found = {}
    for name, solver in SOLVERS.items():
        if model in solver.models and options.asked <= solver.abilities:
            try:
                found[name] = solver.solve(observations, model, options)
            except CalibError as error:
                print(f"\n{name} on {model}: {error}\n")
    return found


def unaligned_px(a: Camera, b: Camera) -> float:
    """The largest difference over the image with the frames as they are."""
    pixels = pixel_grid(a.image_size).reshape(-1, 2)
    return float(np.nanmax(np.linalg.norm(b.project(a.unproject(pixels)) - pixels, axis=1)))


def exact() -> None:
    """Print how far from the truth solvers end that are given it."""
    print("### From exact pixels\n")
    print("| world | model | solver | worst px | worst px, aligned | rms px |\n|---|---|---|---|---|---|")
    worlds = [("seed's", "opencv4", seed_world(50, 0.0))]
    worlds += [("wide", model, wide_world(model, 0.0)) for model in ("pinhole", "opencv5", "opencv8", "opencv12")]
    worlds += [("wide", model, wide_world(model, 0.0)) for model in ("opencv14", "opencv_fisheye")]
    for world, model, (camera, observations) in worlds:
        for name, found in solutions(observations, model).items():
            worst, aligned = unaligned_px(camera, found.camera), compare(camera, found.camera).worst_px
            print(f"| {world} | {model} | {name} | {worst:.1e} | {aligned:.1e} | {found.rms_px:.1e} |")


def agreement() -> None:
    """Print how far from each other solvers end that are given the same."""
    print(
        "\n### One minimum\n\n| observations | model | solvers | worst px | worst px, aligned |\n|---|---|---|---|---|"
    )
    left = []
    sets = [("Sandia", model, sandia()) for model in ("pinhole", "opencv4", "opencv5", "opencv8")]
    sets += [("seed's world", model, seed_world(50, NOISE_PX)[1]) for model in ("opencv4", "opencv5")]
    # more coefficients than that lens has any use for
    valleys = ("opencv8", "opencv12", "opencv14")
    sets += [("seed's world, fitted corners", model, seed_world(50, FITTED_PX)[1]) for model in valleys]
    models = ("opencv4", "opencv8", "opencv12", "opencv14", "opencv_fisheye")
    sets += [("wide world", model, wide_world(model, NOISE_PX)[1]) for model in models]
    for what, model, observations in sets:
        found = solutions(observations, model)
        for a, b in combinations(found, 2):
            one, other = found[a].camera, found[b].camera
            print(
                f"| {what} | {model} | {a}, {b} | {unaligned_px(one, other):.1e} | {compare(one, other).worst_px:.1e} |"
            )
        left += [
            f"| {what} | {model} | {name} | {remaining_sigmas(c):.1e} | {c.rms_px:.9f} | "
            f"{', '.join(problem.code for problem in c.problems)} |"
            for name, c in found.items()
        ]
    free = solutions(seed_world(20, NOISE_PX)[1], "opencv4", SolveOptions(board_shape="free"))
    for a, b in combinations(free, 2):
        one, other = free[a].camera, free[b].camera
        worst = f"{unaligned_px(one, other):.1e} | {compare(one, other).worst_px:.1e}"
        print(f"| seed's world, 20 views, board free | opencv4 | {a}, {b} | {worst} |")
        boards = np.abs(free[a].board.points - free[b].board.points).max()
        print(f"\nTheir boards as solved differ by at most {boards * 1e3:.1e} mm.")
    print(
        "\n| observations | model | solver | sigmas left | rms px | it says |\n|---|---|---|---|---|---|",
        *left,
        sep="\n",
    )


def times() -> None:
    """Print how long solvers take."""
    print(
        "\n### Time, opencv4, 418 corners a view\n\n| views |", " | ".join(f"{n} s (of opencv)" for n in SOLVERS), "|"
    )
    print("|---|" + "---|" * len(SOLVERS))
    for views in (50, 200, 1000):
        _, observations = seed_world(views, NOISE_PX)
        quickest = dict.fromkeys(SOLVERS, np.inf)
        for _ in range(REPEATS):  # in turn, so that a busy machine slows all of them
            for name, solver in SOLVERS.items():
                start = time.perf_counter()
                solver.solve(observations, "opencv4", PLAIN)
                quickest[name] = min(quickest[name], time.perf_counter() - start)
        cells = [f"{seconds:.2f} ({seconds / quickest['opencv']:.1f})" for seconds in quickest.values()]
        print(f"| {views} |", " | ".join(cells), "|")


def main() -> None:
    """Print everything."""
    print(", ".join(f"{name} {solver.version()}" for name, solver in SOLVERS.items()), "\n")
    exact()
    agreement()
    times()


if __name__ == "__main__":
    main()
