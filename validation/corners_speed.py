"""What the fit of the corners costs, and what its compiled part costs to load.

Claim
    The fit of 400 corners takes at most 40 ms on one core (median), whatever the detector was off; its compiled part is
    loaded within 10 ms.

Way
    A photograph of 1626x1236 with 378 corners at the largest window, starts 0.7 px off, one thread; times are scaled to
    400 corners, of the processor where not said otherwise. Two threads do the same work each at the same time. Starting
    is measured in new processes, of which the first does not count. Only worth something on a quiet machine.

Run ``python validation/bench.py corners_speed``.
"""

import subprocess
import sys
import threading
import time
from collections.abc import Callable

import cv2
import numpy as np
from _corner_subpix import by_subpix
from _corner_views import Case, View, photograph

START = (
    "import time; a = time.perf_counter(); import opencsp_calib.corners; b = time.perf_counter();"
    "from opencsp_calib.native import native_function; native_function('fit_corners'); c = time.perf_counter();"
    "print(b - a, c - b)"
)


def milliseconds(run: Callable[[], object], repeats: int, clock: Callable[[], float]) -> np.ndarray:
    """How long each of the repeats takes."""
    times = []
    for _ in range(repeats):
        begin = clock()
        run()
        times.append(1e3 * (clock() - begin))
    return np.array(times)


def in_threads(view: View, count: int) -> None:
    """The same work in each."""
    threads = [threading.Thread(target=view.refined) for _ in range(count)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def fitting() -> None:
    """Print what the fit takes."""
    cv2.setNumThreads(1)
    view = photograph(Case())
    per_400 = 400 / len(view.truth)
    view.refined()
    ours = milliseconds(view.refined, 40, time.process_time) * per_400
    grey, start = view.image.pixels.astype(np.float32), view.start.astype(np.float32)
    theirs = milliseconds(lambda: by_subpix(grey, start, 11), 20, time.process_time) * per_400
    print("| 400 corners | median ms | least ms |\n|---|---|---|")
    for name, times in (("ours", ours), ("cornerSubPix 11", theirs)):
        print(f"| {name} | {np.median(times):.1f} | {times.min():.1f} |")
    one, two = (milliseconds(lambda n=n: in_threads(view, n), 20, time.perf_counter) for n in (1, 2))
    print(f"\nTwo threads take {np.median(two) / np.median(one):.2f} times the wall time of one.")


def starting() -> None:
    """Print what the first use takes."""
    told = []
    for _ in range(6):
        done = subprocess.run([sys.executable, "-c", START], check=True, capture_output=True, text=True)
        told.append([float(word) for word in done.stdout.split()])
    imports, load = np.median(told[1:], axis=0)
    print(f"\n`import opencsp_calib.corners` takes {imports:.2f} s, to load the compiled part {1e3 * load:.1f} ms.")


def main() -> None:
    """Print the figures."""
    fitting()
    starting()


if __name__ == "__main__":
    main()
