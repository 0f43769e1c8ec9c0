"""Two thousand images: memory, time, and runs killed again and again.

Claims
    The peak memory of ``detect`` and of ``calibrate --select 60`` for 2 000 images is within 20 % of that for 200;
    their time grows in proportion to the number of images; a ``detect`` that is killed (SIGKILL) at ten random moments
    and resumed gives the same observations as one run through, to the last bit, and looks at no image twice.

Way
    2 000 rendered photographs of 480 x 360 pixels, all different; the commands as users run them, each in a process of
    its own. Memory is the peak resident set of the whole process (VmHWM). Time is processor time, user and system,
    since other work on the machine does not count in it; a run of 20 images gives the start-up, which is taken off.
    Images looked at are counted by the lines of the journal after every kill.

Run ``python validation/bench.py scale``.
"""

import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from _photographs import write_photographs
from _run import Run

from opencsp_calib import Camera, Checkerboard
from opencsp_calib.hdf5_calibration import load_observations
from opencsp_calib.journal import journal_beside
from opencsp_calib.synthetic import seed_poses

SPEC, BOARD = "checkerboard:9x6:30mm", Checkerboard(9, 6, 0.03)
CAMERA = Camera("small", "opencv4", [600.0, 600.0, 245.0, 178.0, -0.12, 0.05, 1e-3, -5e-4], (480, 360))
FEW, SOME, MANY, KILLS = 20, 200, 2000, 10


def photographs(root: Path) -> None:
    """Render the largest folder; the smaller ones link to its first."""
    poses = seed_poses(BOARD, CAMERA, MANY, rng=5)
    order = np.random.default_rng(6).permutation(MANY)  # so that the first are not all horizontal
    write_photographs(root / str(MANY), CAMERA, BOARD, [poses[index] for index in order])
    for count in (FEW, SOME):
        (root / str(count)).mkdir()
        for file in sorted((root / str(MANY)).iterdir())[:count]:
            os.link(file, root / str(count) / file.name)


def growth(root: Path) -> None:
    """Memory and time by the number of images."""
    print("| command | images | peak MB | of 200 | processor s | less start-up, of 200 |\n|---|---|---|---|---|---|")
    for name, options in (("detect", []), ("calibrate --select 60", ["--select", "60"])):
        command = [sys.executable, "-m", "opencsp_calib", name.split()[0], "--board", SPEC, *options]
        command += ["-o", str(root / "out.h5")]
        few, some, many = (Run.of([*command, str(root / str(count))]) for count in (FEW, SOME, MANY))
        for count, run in ((SOME, some), (MANY, many)):
            memory, time_ = run.peak_mb / some.peak_mb, (run.cpu_s - few.cpu_s) / (some.cpu_s - few.cpu_s)
            print(
                f"| {name} | {count} | {run.peak_mb:.0f} | {memory:.2f} | {run.cpu_s:.1f} | {time_:.1f} |", flush=True
            )
    print(f"\nin proportion, less start-up, would be {(MANY - FEW) / (SOME - FEW):.1f}\n")


def killed(root: Path) -> None:
    """Kill a run again and again, at moments spread over its whole course."""
    folder, whole, pieces = root / str(MANY), root / "whole.h5", root / "pieces.h5"
    command = [sys.executable, "-m", "opencsp_calib", "detect", str(folder), "--board", SPEC, "--resume", "-o"]
    journal, done = journal_beside(pieces), []
    subprocess.run([*command, str(whole)], check=True, stderr=subprocess.DEVNULL)
    moments = sorted(random.Random(7).sample(range(1, MANY), KILLS))  # noqa: S311  # no secret
    for moment in moments:
        process = subprocess.Popen([*command, str(pieces)], stderr=subprocess.DEVNULL)
        while process.poll() is None and (len(images_in(journal)) if journal.exists() else 0) < moment:
            time.sleep(0.02)
        process.send_signal(signal.SIGKILL)
        process.wait()
        done.append(len(images_in(journal)))
    again = sum(count - 1 for count in Counter(images_in(journal)).values())
    subprocess.run([*command, str(pieces)], check=True, stderr=subprocess.DEVNULL)
    print(f"killed after {', '.join(map(str, done))} of {MANY} images; looked at twice: {again}")
    print(f"result identical to an uninterrupted run: {same(whole, pieces)}")


def images_in(journal: Path) -> list[str]:
    """The image of every whole line."""
    lines = journal.read_bytes().split(b"\n")
    return [line.split(b" ")[3].decode() for line in lines if line.count(b" ") > 3 and line.endswith(b"}")]


def same(one: Path, other: Path) -> bool:
    """Whether two files of observations hold the same to the last bit."""
    views = (load_observations(path).views for path in (one, other))
    return all(
        (a.image, a.status, a.problems, a.sha256) == (b.image, b.status, b.problems, b.sha256)
        and np.array_equal(a.detection.pixels, b.detection.pixels)
        and np.array_equal(np.asarray(a.detection.covariance), np.asarray(b.detection.covariance))
        for a, b in zip(*views, strict=True)
    )


def main() -> None:
    """Run all of it."""
    with tempfile.TemporaryDirectory() as temporary:
        root = Path(temporary)
        photographs(root)
        growth(root)
        killed(root)


if __name__ == "__main__":
    main()
