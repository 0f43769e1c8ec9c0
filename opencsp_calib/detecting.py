"""Looking at many images at once: several at a time, in bounded memory, in order, with nothing done twice."""

import threading
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import replace
from itertools import islice
from typing import TypeAlias

from opencsp_calib.board import Board
from opencsp_calib.corners import prepare
from opencsp_calib.detection import Observations, Problem, View
from opencsp_calib.errors import CancelledError, InputError
from opencsp_calib.images import EncodedImage, ImageFile, read_encoded
from opencsp_calib.looking import Look, Search
from opencsp_calib.opencv import opencv_on_one_thread

__all__ = ["Progress", "Stop", "look_at"]

Progress: TypeAlias = Callable[[int, int, View], None]
Stop: TypeAlias = threading.Event


def look_at(
    files: Sequence[ImageFile], search: Search, jobs: int, progress: Progress | None = None, stop: Stop | None = None
) -> Observations:
    """Look for a board in image files, several at a time.

    Threads do the work, because reading, searching and fitting release Python's lock; so it also works in a plain
    script. At most one image a thread is in memory.

    Parameters
    ----------
    files : sequence of ImageFile
    search : Search
    jobs : int
        Threads.
    progress, stop : optional
        See `opencsp_calib.pipeline.detect`.

    Returns
    -------
    Observations

    Raises
    ------
    InputError
        If no image can be read.
    CancelledError
    """
    if search.refine == "model":
        prepare()  # loads the compiled fit while the first images are read

    def look(file: ImageFile) -> Look:
        return _look(file, search.look)

    with opencv_on_one_thread():
        looks = _in_threads(files, look, jobs, progress, stop)
    return _gathered(looks, search.board)


def _look(file: ImageFile, examine: Callable[[EncodedImage], Look]) -> Look:
    try:
        encoded = read_encoded(file)
    except InputError as error:
        return Look.unreadable(file.name, str(error))
    return examine(encoded)


def _in_threads(
    files: Sequence[ImageFile],
    look: Callable[[ImageFile], Look],
    jobs: int,
    progress: Progress | None,
    stop: Stop | None,
) -> list[Look]:
    looks: dict[int, Look] = {}
    waiting_files = iter(enumerate(files))
    running: dict[Future[Look], int] = {}
    pool = ThreadPoolExecutor(jobs, thread_name_prefix="detect")
    try:
        while len(looks) < len(files):
            for index, file in islice(waiting_files, 2 * jobs - len(running)):
                running[pool.submit(look, file)] = index
            done, _ = wait(running, timeout=0.1, return_when=FIRST_COMPLETED)
            if stop is not None and stop.is_set():
                raise CancelledError(f"stopped after {len(looks)} of {len(files)} images; nothing was written")
            for future in done:
                index = running.pop(future)
                looks[index] = future.result()
                if progress:
                    progress(len(looks), len(files), looks[index].view)
    finally:
        pool.shutdown(cancel_futures=True)
    return [looks[index] for index in range(len(files))]


def _gathered(looks: Sequence[Look], board: Board) -> Observations:
    """One set: of one image size, without the same file twice."""
    sizes = Counter(look.size for look in looks if look.size and look.view.status == "used")
    sizes = sizes or Counter(look.size for look in looks if look.size)
    if not sizes:
        first = looks[0].view
        raise InputError(f"none of the {len(looks)} images can be read; the first: {first.detection.reason}")
    size = sizes.most_common(1)[0][0]
    seen: dict[str, str] = {}
    views = []
    for look in looks:
        view = look.view
        if look.size and look.size != size:
            view = _wrong_size(view, look.size, size)
        elif view.sha256 in seen:
            view = _duplicate(view, seen[view.sha256])
        elif view.sha256:
            seen[view.sha256] = view.image
        views.append(view)
    return Observations(board, size, tuple(views))


def _wrong_size(view: View, size: tuple[int, int], expected: tuple[int, int]) -> View:
    reason = f"is {size[0]}x{size[1]}, while most images are {expected[0]}x{expected[1]}: another camera or setting"
    return replace(view, status="wrong size", problems=(*view.problems, Problem("wrong-size", reason)))


def _duplicate(view: View, first: str) -> View:
    problem = Problem("duplicate", f"is the same file as {first}")
    return replace(view, status="duplicate", problems=(*view.problems, problem))
