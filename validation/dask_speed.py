"""Two Dask workers against one, and against threads on this machine.

Claim
    With a core each, two workers look at images at least 1.7 times as fast as one; the result is the same to the last
    bit.

Way
    Rendered photographs of 1626 x 1236 pixels; a scheduler and workers of one thread each on loopback; each worker has
    looked at a few images before the clock starts. Wall time, so run it on a machine with nothing else to do; the
    client and the scheduler take a little of the same two cores. Processor time of client and scheduler (one process
    here) per image tells what they cost.

Run ``python validation/bench.py dask_speed``.
"""

import tempfile
import time
from pathlib import Path

import numpy as np
from _photographs import write_photographs
from distributed import Client, LocalCluster

from opencsp_calib import Checkerboard, Observations, detect
from opencsp_calib.synthetic import demo_camera, seed_poses

COUNT, WARM = 200, 8
BOARD = Checkerboard(21, 18, 0.05)


def timed(files: list[Path], **how: object) -> tuple[float, float, Observations]:
    """Wall seconds, processor seconds of this process, and what was found."""
    wall, processor = time.perf_counter(), time.process_time()
    found = detect(files, BOARD, **how)
    return time.perf_counter() - wall, time.process_time() - processor, found


def main() -> None:
    """Print the table."""
    with tempfile.TemporaryDirectory() as temporary:
        camera = demo_camera()
        write_photographs(Path(temporary), camera, BOARD, seed_poses(BOARD, camera, COUNT))
        files = sorted(Path(temporary).iterdir())
        detect(files[:WARM], BOARD)
        one_thread, _, expected = timed(files, jobs=1)
        two_threads, _, _ = timed(files, jobs=2)
        print("| images looked at by | wall s | times as fast | client and scheduler, processor ms an image |")
        print("|---|---|---|---|")
        print(f"| one thread | {one_thread:.1f} | | |")
        print(f"| two threads | {two_threads:.1f} | {one_thread / two_threads:.2f} | |")
        walls = []
        for workers in (1, 2):
            own = {"host": "127.0.0.1", "dashboard_address": "127.0.0.1:0", "worker_dashboard_address": "127.0.0.1:0"}
            with LocalCluster(n_workers=workers, threads_per_worker=1, **own) as cluster, Client(cluster) as client:
                client.wait_for_workers(workers)
                detect(files[: WARM * workers], BOARD, scheduler=client)
                wall, processor, found = timed(files, scheduler=client)
            walls.append(wall)
            pairs = zip(found.views, expected.views, strict=True)
            same = all(
                a.status == b.status and np.array_equal(a.detection.pixels, b.detection.pixels) for a, b in pairs
            )
            ratio = f"{walls[0] / wall:.2f}" if workers > 1 else ""
            print(f"| {workers} Dask worker(s) | {wall:.1f} | {ratio} | {1e3 * processor / COUNT:.1f} |", flush=True)
            print(f"| the same to the last bit: {same} | | | |")


if __name__ == "__main__":
    main()
