"""How long the whole command takes, and how much memory, against bare scripts of the same OpenCV calls.

Claim
    From 50 images of 1626 x 1236, ``--preset opencsp`` takes at most 1.5 times the wall time of a script that makes the
    same OpenCV calls one after another; the default, with fitted corners, honest uncertainty and the board's shape
    decided, at most 1.5 times the seed's way; from 200 images it is at least 3 times quicker than the seed's way with
    the OpenCV below 4.10 that OpenCSP pins. Peak memory does not grow with the number of images by more than their
    corners.

Way
    Rendered photographs; each command in a process of its own, start-up included, by turns and in alternating order,
    where there are several runs after one that warms the caches; ratios of the least times, and of the least processor
    times (user and system). The pinned OpenCV is installed with pip into an environment of its own, or the Python of
    one is named as an argument. Memory is the peak resident set of the whole process.

Run ``python validation/bench.py whole_run``.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from venv import EnvBuilder

from _photographs import write_photographs
from _run import Run

from opencsp_calib import Camera, Checkerboard
from opencsp_calib.synthetic import demo_camera, seed_poses

SEEDS_WAY = """
import sys, glob, numpy as np, cv2 as cv
columns, rows = 21, 18
grid = np.zeros((columns * rows, 3), np.float32)
grid[:, :2] = np.mgrid[0:columns, 0:rows].T.reshape(-1, 2)
board, corners = [], []
for name in sorted(glob.glob(sys.argv[1] + "/*.png")):
    image = cv.imread(name, cv.IMREAD_GRAYSCALE)
    flags = cv.CALIB_CB_ADAPTIVE_THRESH + cv.CALIB_CB_NORMALIZE_IMAGE
    found, points = cv.findChessboardCorners(image, (columns, rows), None, flags)
    if found:
        criteria = (cv.TERM_CRITERIA_EPS + cv.TermCriteria_COUNT, 40, 0.001)
        corners.append(cv.cornerSubPix(image, points, (11, 11), (-1, -1), criteria))
        board.append(grid)
cv.calibrateCamera(board, corners, image.shape[::-1], None, np.zeros(4), flags=cv.CALIB_FIX_K3)
"""
"""What OpenCSP does, and what ``--preset opencsp`` does: the same calls."""

SPEC = "checkerboard:21x18:50mm"
PINNED = ("opencv-python-headless>=4.9,<4.10", "numpy<2")
SMALL = Camera("small", "opencv4", [1100, 1100, 320, 240, -0.1, 0.05, 0, 0], (640, 480))


def photographs(folder: Path, count: int, camera: Camera) -> None:
    """Render photographs as the seed's procedure asks for them."""
    board = Checkerboard(21, 18, 0.05)
    write_photographs(folder, camera, board, seed_poses(board, camera, count))


def ours(folder: Path, *options: str) -> list[str]:
    """The whole command."""
    output = str(folder.parent / "camera.h5")
    command = [sys.executable, "-m", "opencsp_calib", "calibrate", str(folder), "--board", SPEC, "-o", output]
    return [*command, *options]


def pinned_python(folder: Path) -> str:
    """Python of an environment with OpenCSP's OpenCV: the one that was named, or a new one."""
    if sys.argv[1:]:
        return sys.argv[1]
    EnvBuilder(with_pip=True).create(folder)
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    subprocess.run([python, "-m", "pip", "install", "-q", *PINNED], check=True)
    return str(python)


def raced(title: str, commands: dict[str, list[str]], times: int) -> None:
    """Print the rows of a table: each command's least wall and CPU time, with ratios to the first one's."""
    runs: dict[str, list[Run]] = {name: [] for name in commands}
    if times > 1:
        for command in commands.values():
            Run.of(command)
    for turn in range(times):
        for name in commands if turn % 2 == 0 else reversed(commands):
            runs[name].append(Run.of(commands[name]))
    walls = {name: min(run.wall_s for run in found) for name, found in runs.items()}
    cpus = {name: min(run.cpu_s for run in found) for name, found in runs.items()}
    base = next(iter(commands))
    for name in commands:
        ratios = f"{walls[name] / walls[base]:.2f} | {cpus[name]:.2f} | {cpus[name] / cpus[base]:.2f}"
        print(f"| {title} | {name} | {walls[name]:.2f} | {ratios} |", flush=True)


def memory(folder: Path) -> None:
    """Print the peak memory of a run on few and on many images, and what the corners of the others take."""
    peaks = {}
    for count in (50, 500):
        photographs(folder / f"small{count}", count, SMALL)
        peaks[count] = Run.of(ours(folder / f"small{count}")).peak_mb
        print(f"{count} images of 640x480: {peaks[count]:.0f} MB at most", flush=True)
    corners = 450 * 21 * 18 * (2 + 4 + 2 + 2) * 8 / 2**20  # pixels, covariance, edge width and contrast, residuals
    print(f"450 images more take {peaks[500] - peaks[50]:.0f} MB more; their corners alone are {corners:.0f} MB")


def main() -> None:
    """Run all of it."""
    print("| images | command | wall s | ratio | CPU s | ratio |\n|---|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary:
        root = Path(temporary)
        python = pinned_python(root / "pinned")
        for count, times in ((50, 4), (200, 2)):
            photographs(root / str(count), count, demo_camera())
            bare = ["-c", SEEDS_WAY, str(root / str(count))]
            commands = {
                "the seed's way, this OpenCV": [sys.executable, *bare],
                "--preset opencsp": ours(root / str(count), "--preset", "opencsp"),
                "default": ours(root / str(count)),
                "the seed's way, OpenCV 4.9": [python, *bare],
            }
            if count == 200:
                del commands["--preset opencsp"]
            raced(f"{count}", commands, times)
        memory(root)


if __name__ == "__main__":
    main()
