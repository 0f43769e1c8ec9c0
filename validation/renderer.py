"""Are rendered photographs true? Edges in them against OpenCV's projection of those edges; and what they cost.

Claim
    Every edge and corner is where the camera projects it, to better than 1e-4 px rms.

Way
    Shares nothing with the renderer but the lens parameters. Edges are projected by OpenCV, and found in the image by
    adding up light along a row (or column) of pixels across them, which no symmetric blur can change but by the edge's
    own bend, which is taken off. Blur wider than 2 px cannot be judged like this: with squares of down to 25 px the
    light of the next corners reaches the middle of an edge.

Run ``python validation/bench.py renderer``.
"""

import sys
import tempfile
import time
from collections.abc import Callable, Iterator

import cv2
import numpy as np

from opencsp_calib import Board, Camera, Checkerboard, Pose
from opencsp_calib.demo import make_demo
from opencsp_calib.rendering import Exposure, Scene, render
from opencsp_calib.synthetic import bowed, demo_camera, seed_poses

REACH = 12  # pixels to either side of an edge
EVEN = Scene(white=200.0, black=20.0, clutter=0.0, shading=(0.0, 0.0))
BOARD = Checkerboard(21, 18, 0.05)
BOW_M = 0.0015
FISHEYE = Camera("fisheye", "opencv_fisheye", [2600.0, 2600.0, 829.0, 626.0, 0.03, -0.02, 0.01, 0.0], (1626, 1236))
BLURS = {
    "none but the pixel": {"psf_px": 0.0},
    "Gaussian 0.3 px": {"psf_px": 0.3},
    "Gaussian 0.6 px": {"psf_px": 0.6},
    "Gaussian 0.6, disc 2.5 px": {"psf_px": 0.6, "defocus_px": 2.5},
    "Gaussian 0.6, motion (3, 1) px": {"psf_px": 0.6, "motion_px": (3.0, 1.0)},
    "Gaussian 2 px": {"psf_px": 2.0},
}

Edge = Callable[[float], np.ndarray]  # from a fraction of the edge to its pixel


def project(camera: Camera, points: np.ndarray, pose: Pose) -> np.ndarray:
    """Pixels by OpenCV."""
    points = np.asarray(points, dtype=np.float64).reshape(-1, 1, 3)
    model = cv2.fisheye.projectPoints if camera.model == "opencv_fisheye" else cv2.projectPoints
    rotation, translation = np.array(pose.rotation), np.array(pose.translation)
    return model(points, rotation, translation, camera.matrix, np.array(camera.distortion))[0][:, 0]


def edges(camera: Camera, pose: Pose, bow_m: float) -> Iterator[Edge]:
    """All edges between neighbouring corners of the board."""
    columns, rows = BOARD.grid
    half = np.array([columns - 1, rows - 1]) / 2.0

    def edge(start: np.ndarray, along: np.ndarray) -> Edge:
        def pixel(t: float) -> np.ndarray:
            place = start + t * along
            height = bow_m * (1.0 - 0.5 * ((place / half - 1.0) ** 2).sum())
            return project(camera, [*(place * BOARD.spacing_m), height], pose)[0]

        return pixel

    for i in range(columns):
        for j in range(rows):
            if j + 1 < rows:
                yield edge(np.array([i, j], float), np.array([0.0, 1.0]))
            if i + 1 < columns:
                yield edge(np.array([i, j], float), np.array([1.0, 0.0]))


def error(image: np.ndarray, pixel: Edge, spread_xy: np.ndarray) -> float:
    """How far the light says the edge is from where OpenCV says, pixels along the row or column; NaN if cut short."""
    direction = pixel(0.7) - pixel(0.3)
    across = 0 if abs(direction[1]) > abs(direction[0]) else 1  # scan x along a row, or y along a column
    picture = image if across == 0 else image.T
    line, t = round(float(pixel(0.5)[1 - across])), 0.5
    for _ in range(8):
        slope = (pixel(t + 1e-4) - pixel(t - 1e-4))[1 - across] / 2e-4
        t -= (pixel(t)[1 - across] - line) / slope
    (x0, y0), (x1, y1), (x2, y2) = (pixel(s)[[across, 1 - across]] for s in (t - 0.1, t, t + 0.1))
    bend = 2.0 * ((x2 - x1) / (y2 - y1) - (x1 - x0) / (y1 - y0)) / (y2 - y0)
    first = round(float(x1)) - REACH
    profile = picture[line, max(first, 0) : first + 2 * REACH + 1]
    if len(profile) < 2 * REACH + 1 or first < 0 or abs(profile[0] - profile[-1]) < 50.0:
        return np.nan
    found = first - 0.5 + ((profile - profile[-1]) / (profile[0] - profile[-1])).sum()
    return float(found - x1 - 0.5 * bend * spread_xy[1 - across])


def errors(camera: Camera, board: Board, bow_m: float, pose: Pose, blur: dict[str, object]) -> np.ndarray:
    """Of every edge of one noise-free photograph."""
    exposure = Exposure(**blur, noise=0.0, vignetting=0.0, bits=16)
    image = render(camera, board, pose, scene=EVEN, exposure=exposure).pixels / 257.0
    round_part = 1.0 / 12.0 + exposure.psf_px**2 + exposure.defocus_px**2 / 4.0
    spread = round_part + np.array(exposure.motion_px) ** 2 / 12.0
    found = np.array([error(image, edge, spread) for edge in edges(camera, pose, bow_m)])
    return found[np.isfinite(found)]


def main() -> None:
    """Print the results as Markdown."""
    print(
        "1626x1236, board of 22x19 squares, 4 poses of the seed's procedure a row, no noise, 16 bit (1/257 grey level;"
    )
    print("rounding alone gives about 1e-5 px).\n")
    print("| lens | board | blur | edges | mean px | rms px | worst px |\n|---|---|---|---|---|---|---|")
    for camera in (demo_camera(), FISHEYE):
        poses = [seed_poses(BOARD, camera)[view] for view in (0, 8, 27, 43)]
        for bow_m in (0.0, BOW_M):
            board = bowed(BOARD, bow_m) if bow_m else BOARD
            for name, blur in BLURS.items():
                found = np.concatenate([errors(camera, board, bow_m, pose, blur) for pose in poses])
                figures = f"{found.mean():+.1e} | {np.sqrt((found**2).mean()):.1e} | {np.abs(found).max():.1e}"
                shape = f"bowed by {bow_m * 1e3:g} mm" if bow_m else "flat"
                print(f"| {camera.model} | {shape} | {name} | {len(found)} | {figures} |")
                sys.stdout.flush()
    print("\n### Cost\n")
    with tempfile.TemporaryDirectory() as folder:
        make_demo(folder, views=2)  # nothing is timed that is done once
        wall, work = time.perf_counter(), time.process_time()
        make_demo(folder, views=50, jobs=2)
        wall, work = time.perf_counter() - wall, time.process_time() - work
    print(
        f"The demo's 50 photographs, as PNG: {work:.1f} s of processor time in two threads, {wall:.1f} s by the clock."
    )


if __name__ == "__main__":
    main()
