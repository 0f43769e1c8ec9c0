"""Looking at many images at once: several at a time, in bounded memory, in order, with nothing done twice."""

import os
import sys
import threading
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from contextlib import ExitStack
from dataclasses import replace
from itertools import islice
from typing import TypeAlias

from opencsp_calib.blas import blas_on_one_thread
from opencsp_calib.board import Board
from opencsp_calib.cluster import Scheduler, connected
from opencsp_calib.counted import counted
from opencsp_calib.detection import Detection, Observations, Problem, View
from opencsp_calib.errors import CancelledError, InputError
from opencsp_calib.images import EncodedImage, ImageFile, read_encoded
from opencsp_calib.journal import Journal
from opencsp_calib.looking import OTHER_BOARD, Look, Search
from opencsp_calib.opencv import opencv_on_one_thread
from opencsp_calib.process_setting import ProcessSetting, Restore

__all__ = ["Progress", "Stop", "check_board_seen", "look_at", "usable_cores"]

Progress: TypeAlias = Callable[[int, int, View], None]
Stop: TypeAlias = threading.Event

TURN_S = 0.0005


def look_at(
    files: Sequence[ImageFile],
    search: Search,
    jobs: int | None = None,
    progress: Progress | None = None,
    stop: Stop | None = None,
    journal: Journal | None = None,
    scheduler: "Scheduler | None" = None,
) -> Observations:
    """Look for a board in image files, several at a time.

    Threads do the work, because reading, searching and fitting release Python's lock; so it also works in a plain
    script. At most one image a thread is in memory. With a Dask cluster, each thread waits for a worker that does it.

    Parameters
    ----------
    files : sequence of ImageFile
    search : Search
    jobs : int, optional
        Threads; by default one a core, and with a cluster twice as many as its workers have.
    progress, stop, journal, scheduler : optional
        See `opencsp_calib.pipeline.detect`.

    Returns
    -------
    Observations

    Raises
    ------
    InputError
        If no image can be read, or the cluster cannot be used.
    CancelledError
    """
    ended = threading.Event()
    with ExitStack() as stack:
        stack.enter_context(opencv_on_one_thread())
        stack.enter_context(blas_on_one_thread())
        stack.enter_context(_quick_turns.changed())
        if journal is not None:
            stack.enter_context(journal.open(search.key))
        if scheduler is not None:
            cluster = stack.enter_context(connected(scheduler, search, ended))
            examine, threads = cluster.look, jobs or cluster.in_flight
        else:
            examine, threads = search.look, jobs or usable_cores()
        looks = _in_threads(files, lambda file: _look(file, examine, journal), threads, ended, progress, stop)
    return _gathered(looks, search.board)


def check_board_seen(observations: Observations) -> None:
    """Refuse a set in which no image shows the board, or only parts of it, which may well be another board's.

    A part of a smaller board looks like a part of the one that is looked for, if the rest may be out of view. So where
    some images show another board whole, and none the board itself, its description is wrong.

    Raises
    ------
    InputError
    """
    if not observations.used:
        reasons = [view.detection.reason for view in observations.views if view.detection.reason]
        why = max(set(reasons), key=reasons.count) if reasons else "no image can be used"
        raise InputError(f"no board to calibrate from in {counted(len(observations.views), 'image')}: {why}")
    others = [view for view in observations.views if any(p.code == OTHER_BOARD for p in view.problems)]
    if others and not any(_whole(view.detection, observations.board) for view in observations.used):
        more = f" and {len(others) - 1} more show" if len(others) > 1 else " shows"
        raise InputError(
            f"{others[0].image}{more} another board, and no image the whole of this one: {others[0].detection.reason}"
        )


def _whole(detection: Detection, board: Board) -> bool:
    return len(detection) + len(detection.rejected) == len(board.points)


def usable_cores() -> int:
    """How many cores this process may use."""
    affinity = getattr(os, "sched_getaffinity", None)  # not on Windows and macOS
    return len(affinity(0)) if affinity else os.cpu_count() or 1


def _take_turns_quickly() -> Restore:
    """Threads wait less for Python's lock: with the usual 5 ms, the cores stand still for a tenth of the time."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(min(TURN_S, before))
    return lambda: sys.setswitchinterval(before)


_quick_turns = ProcessSetting(_take_turns_quickly)


def _look(file: ImageFile, examine: Callable[[EncodedImage], Look], journal: Journal | None) -> Look:
    try:
        encoded = read_encoded(file)
    except InputError as error:
        return Look.unreadable(file.name, str(error))
    if journal is None:
        return examine(encoded)
    known = journal.find(encoded.sha256, file.name)
    if known is None:
        known = examine(encoded)
        journal.add(known)
    return known


def _in_threads(
    files: Sequence[ImageFile],
    look: Callable[[ImageFile], Look],
    jobs: int,
    ended: threading.Event,
    progress: Progress | None,
    stop: Stop | None,
) -> list[Look]:
    """In order; `ended` is set as soon as nobody wants what is still under way."""
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
                raise CancelledError(
                    f"stopped after {len(looks)} of {counted(len(files), 'image')}; nothing was written"
                )
            for future in done:
                index = running.pop(future)
                looks[index] = future.result()
                if progress:
                    progress(len(looks), len(files), looks[index].view)
    finally:
        ended.set()
        pool.shutdown(cancel_futures=True)
    return [looks[index] for index in range(len(files))]


def _gathered(looks: Sequence[Look], board: Board) -> Observations:
    """One set: of one image size, without the same file twice."""
    sizes = Counter(look.size for look in looks if look.size and look.view.status == "used")
    sizes = sizes or Counter(look.size for look in looks if look.size)
    if not sizes:
        first = looks[0].view
        raise InputError(f"no image can be read of {len(looks)}; the first: {first.detection.reason}")
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
