"""Speed and memory of solving, against the seed's way, at 10 to 2000 views.

Claim
    Solving takes about as long as OpenCV's ``calibrateCamera``, which the seed calls, and is linear in the number of
    views in time and memory. The whole of ``solve`` with its defaults, which decides on the board's shape and leaves
    out each view in turn for an honest uncertainty, takes about twice as long from 50 views on.

Way
    The seed's procedure (demo camera, 21 x 18 corners, half of the views turned), corners made with noise of 0.1 px.
    Each cell is a process of its own, with BLAS on one thread: processor seconds of the call alone (`Solver.solve` with
    a flat board and equal weights; the whole of `opencsp_calib.solve`; `cv2.calibrateCamera`, four coefficients), and
    by how many MB its peak memory (VmHWM, Linux only) is above what it was before the call. Ratios are to OpenCV's time
    in the same row. With an argument, another Python (with the OpenCV 4.9 that OpenCSP pins) runs its
    ``calibrateCamera``, too.

Run ``python validation/bench.py seeds_way``, or ``python validation/seeds_way.py PYTHON_WITH_OPENCV_4.9``.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from opencsp_calib import Checkerboard
from opencsp_calib.synthetic import demo_camera, observe, seed_poses

VIEWS = (10, 50, 200, 1000, 2000)
PINNED_VIEWS = 200  # OpenCV 4.9 grows with the cube of the views: 22 s for these
BOARD = Checkerboard(21, 18, 0.05)
NOISE_PX = 0.1
MEASURED = """
import json, re, sys, time
import numpy as np
data = np.load(sys.argv[1])
{prepare}
def peak_mb():  # not by ru_maxrss, which begins with that of the process that started this one
    return int(re.search(r"VmHWM:\\s+(\\d+)", open("/proc/self/status").read())[1]) / 1024
before, start = peak_mb(), time.process_time()
{call}
print(json.dumps([time.process_time() - start, peak_mb() - before]))
"""
AS_LISTS = """
import cv2
points = [data['points'].astype(np.float32)] * len(data['pixels'])
pixels = list(data['pixels'].astype(np.float32))
"""
SEEDS = (
    AS_LISTS,
    "cv2.calibrateCamera(points, pixels, (1626, 1236), None, np.zeros(4), flags=cv2.CALIB_FIX_K3)",
)
OBSERVED = """
from opencsp_calib import Checkerboard, Detection, Observations, SolveOptions, View, solve
from opencsp_calib.registry import installed
ids, solver = np.arange(len(data['points'])), installed().solver('bundle')
def seen(count):
    found = [Detection(ids, p, np.tile(0.01 * np.eye(2), (len(p), 1, 1))) for p in data['pixels'][:count]]
    views = tuple(View(str(number), detection, 'used') for number, detection in enumerate(found))
    return Observations(Checkerboard(21, 18, 0.05), (1626, 1236), views)
views, few = seen(None), seen(5)
"""
WAYS = {
    "calibrateCamera": SEEDS,
    "bundle": (
        OBSERVED + "solver.solve(few, 'opencv4', SolveOptions())",
        "solver.solve(views, 'opencv4', SolveOptions())",
    ),
    "solve, all of it": (OBSERVED + "solve(few)", "solve(views)"),
}


def measured(python: str, way: tuple[str, str], data: Path) -> tuple[float, float]:
    """Seconds, and MB above what there was before."""
    command = [python, "-c", MEASURED.format(prepare=way[0], call=way[1]), data]
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}  # whose threads count while they wait
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, env=environment)
    seconds, megabytes = json.loads(done.stdout)
    return seconds, megabytes


def main() -> None:
    """Print the table."""
    pinned = sys.argv[1:2]
    names = [*WAYS, *(["calibrateCamera of OpenCV 4.9"] if pinned else [])]
    print(f"| views | {' | '.join(f'{name}: s (ratio), MB' for name in names)} |\n{'|---' * (1 + len(names))}|")
    camera = demo_camera()
    with tempfile.TemporaryDirectory() as folder:
        for views in VIEWS:
            observations = observe(camera, BOARD, seed_poses(BOARD, camera, views), noise_px=NOISE_PX)
            data = Path(folder) / f"{views}.npz"
            np.savez(data, points=BOARD.points, pixels=np.array([d.pixels for d in observations.detections]))
            found = [measured(sys.executable, way, data) for way in WAYS.values()]
            found += [measured(pinned[0], SEEDS, data)] if pinned and views <= PINNED_VIEWS else []
            cells = [f"{s:.2f} ({s / found[0][0]:.1f}), {mb:.0f}" for s, mb in found]
            print(f"| {views} | {' | '.join(cells + [''] * (len(names) - len(cells)))} |", flush=True)


if __name__ == "__main__":
    main()
