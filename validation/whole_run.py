"""How long the whole command takes, and how much memory, against a bare script that makes the seed's OpenCV calls.

Claim: on 50 images of 1626x1236, ``--preset opencsp`` takes at most 1.5 times the bare script's wall time; so does the
default, with fitted corners, honest uncertainty and the board's shape decided. Peak memory does not grow with the
number of images by more than their corners.

Way: rendered photographs; each command in a process of its own, start-up included, in turn and several times, the
quickest of each taken; ratios from one run. With an argument, another Python (with OpenCSP's pinned OpenCV 4.9) runs
the bare script too. Memory is the peak resident set of the whole process.
"""

import os
import resource
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from opencsp_calib import Camera, Checkerboard
from opencsp_calib.images import write_image
from opencsp_calib.rendering import render
from opencsp_calib.synthetic import demo_camera, seed_poses

BARE = """
import sys, glob, numpy as np, cv2 as cv
columns, rows = 21, 18
grid = np.zeros((columns * rows, 3), np.float32)
grid[:, :2] = np.mgrid[0:columns, 0:rows].T.reshape(-1, 2)
board, corners = [], []
for name in sorted(glob.glob(sys.argv[1] + "/*.png")):
    image = cv.imread(name, cv.IMREAD_GRAYSCALE)
    flags = cv.CALIB_CB_ADAPTIVE_THRESH + cv.CALIB_CB_FAST_CHECK + cv.CALIB_CB_NORMALIZE_IMAGE
    found, points = cv.findChessboardCorners(image, (columns, rows), flags)
    if found:
        criteria = (cv.TERM_CRITERIA_EPS + cv.TermCriteria_COUNT, 40, 0.001)
        corners.append(cv.cornerSubPix(image, points, (11, 11), (-1, -1), criteria))
        board.append(grid)
cv.calibrateCamera(board, corners, image.shape[::-1], None, np.zeros(4), flags=cv.CALIB_FIX_K3)
"""
SPEC = "checkerboard:21x18:50mm"


def photographs(folder: Path, count: int, camera: Camera) -> None:
    """Render photographs as the seed's procedure asks for them."""
    folder.mkdir()
    board = Checkerboard(21, 18, 0.05)
    poses = seed_poses(board, camera, count)
    with ThreadPoolExecutor(2) as pool:
        list(
            pool.map(
                lambda i: write_image(render(camera, board, poses[i], rng=i).pixels, folder / f"{i:04d}.png"),
                range(count),
            )
        )


def measured(command: list[str]) -> tuple[float, float]:
    """Wall seconds, and peak resident MB of the process."""
    started = time.perf_counter()
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        raise RuntimeError(f"failed: {command}")
    return time.perf_counter() - started, usage.ru_maxrss / 1024


def quickest(commands: dict[str, list[str]], times: int) -> dict[str, tuple[float, float]]:
    """The least of each command's times, and the memory of that run."""
    runs = {name: [] for name in commands}
    for _ in range(times):
        for name, command in commands.items():
            runs[name].append(measured(command))
    return {name: min(found) for name, found in runs.items()}


def table(found: dict[str, tuple[float, float]], base: str) -> None:
    """Print the rows, with ratios to one of them."""
    for name, (seconds, megabytes) in found.items():
        print(f"| {name} | {seconds:.2f} | {seconds / found[base][0]:.2f} | {megabytes:.0f} |")


def main() -> None:
    """Run all of it and print the table."""
    pinned = sys.argv[1:2]
    print("| command | s | ratio | peak MB |\n|---|---|---|---|")
    with tempfile.TemporaryDirectory() as temporary:
        for count in (50, 200):
            folder = Path(temporary) / str(count)
            photographs(folder, count, demo_camera())
            ours = [sys.executable, "-m", "opencsp_calib", "calibrate", str(folder), "--board", SPEC]
            ours += ["-o", f"{temporary}/camera.h5"]
            base = f"{count}: bare script, this OpenCV"
            commands = {
                base: [sys.executable, "-c", BARE, str(folder)],
                f"{count}: --preset opencsp": [*ours, "--preset", "opencsp"],
                f"{count}: default": ours,
            }
            if pinned:
                commands[f"{count}: bare script, pinned OpenCV 4.9"] = [pinned[0], "-c", BARE, str(folder)]
            table(quickest(commands, 3 if count == 50 else 1), base)
        small = Camera("small", "opencv4", [1100, 1100, 320, 240, -0.1, 0.05, 0, 0], (640, 480))
        memory = {}
        for count in (50, 500):
            folder = Path(temporary) / f"small{count}"
            photographs(folder, count, small)
            ours = [
                sys.executable,
                "-m",
                "opencsp_calib",
                "calibrate",
                str(folder),
                "--board",
                SPEC,
                "--solver",
                "opencv",
            ]
            memory[f"{count} images of 640x480"] = measured(ours)
        table(memory, "50 images of 640x480")


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    main()
