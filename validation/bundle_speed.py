"""How long bundle takes, against OpenCV's own call on the same observations in the same run.

Claim
    50 views of 378 corners in at most 0.3 s with the board flat and 1 s with its shape free; 1000 views, flat, in at
    most twice OpenCV 5's time; time linear in the number of views.

Way
    The seed's procedure with 21 x 18 corners, independent noise of 0.15 px, model opencv4. Wall times of
    `Solver.solve`, start, checks and covariance included, and of ``cv2.calibrateCamera`` alone, in turn; the quickest
    of five of each, and the median of the five ratios. Other work on the machine makes both slower, not their ratio.

Run ``python validation/bench.py bundle_speed``.
"""

import time
from collections.abc import Callable

import cv2
import numpy as np

from opencsp_calib import Checkerboard, SolveOptions
from opencsp_calib.registry import installed
from opencsp_calib.synthetic import demo_camera, observe, seed_poses

BOARD = Checkerboard(21, 18, 0.05)
CAREFUL = {"weights": "covariance", "robust": True}
WAYS = {
    "flat, equal weights": SolveOptions(),
    "flat, covariance, robust": SolveOptions(**CAREFUL),
    "free, equal weights": SolveOptions(board_shape="free"),
    "free, covariance, robust": SolveOptions(board_shape="free", **CAREFUL),
}
REPEATS = 5


def seconds(call: Callable[[], object]) -> float:
    """Wall time of a call."""
    start = time.perf_counter()
    call()
    return time.perf_counter() - start


def main() -> None:
    """Print the table."""
    print(
        f"\nOpenCV {cv2.__version__}.\n\n| views | what | OpenCV s | bundle s | ratio, median |\n|---|---|---|---|---|"
    )
    camera, solver = demo_camera(), installed().solver("bundle")
    for views in (10, 50, 200, 1000):
        observations = observe(camera, BOARD, seed_poses(BOARD, camera, views), noise_px=0.15)
        points = [BOARD.points[d.ids].astype(np.float32) for d in observations.detections]
        pixels = [d.pixels.astype(np.float32) for d in observations.detections]
        size = observations.image_size

        def theirs(points: object = points, pixels: object = pixels, size: object = size) -> None:
            cv2.calibrateCamera(points, pixels, size, None, None, flags=cv2.CALIB_FIX_K3)

        for what, options in WAYS.items():
            runs = []
            for _ in range(REPEATS):
                ours = seconds(lambda seen=observations, chosen=options: solver.solve(seen, "opencv4", chosen))
                runs.append((seconds(theirs), ours))
            opencv, bundle = np.array(runs).T
            print(f"| {views} | {what} | {opencv.min():.3f} | {bundle.min():.3f} | {np.median(bundle / opencv):.2f} |")


if __name__ == "__main__":
    main()
