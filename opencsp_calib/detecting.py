"""Looking at many images at once: reading, finding, refining, in threads, in bounded memory, in order."""

import threading
from collections import Counter
from collections.abc import Callable, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass, replace
from itertools import islice
from typing import Literal, TypeAlias

from opencsp_calib.board import Board
from opencsp_calib.corners import prepare
from opencsp_calib.corners import refine as refine_by_model
from opencsp_calib.detection import Detection, Observations, Problem, View
from opencsp_calib.errors import CancelledError, InputError
from opencsp_calib.image import Image
from opencsp_calib.images import ImageFile, opencv_on_one_thread, read_image
from opencsp_calib.interfaces import Detector
from opencsp_calib.photograph import problems_of
from opencsp_calib.subpix import refine_subpix

__all__ = ["Progress", "Refine", "Stop", "find_board", "look_at"]

MIN_CORNERS = 6  # twelve numbers for the six of a pose: as many again to check it by

Refine: TypeAlias = Literal["none", "subpix", "model"]
Progress: TypeAlias = Callable[[int, int, View], None]
Stop: TypeAlias = threading.Event


@dataclass(frozen=True)
class Look:
    """A view, and the size of its image if that could be read."""

    view: View
    size: tuple[int, int] | None


def look_at(
    files: Sequence[ImageFile],
    board: Board,
    detector: Detector,
    refine: Refine | None,
    jobs: int,
    progress: Progress | None = None,
    stop: Stop | None = None,
) -> Observations:
    """Look for a board in image files, several at a time.

    Threads do the work, because reading, searching and fitting release Python's lock; so it also works in a plain
    script. At most two images a thread are in memory.

    Parameters
    ----------
    files : sequence of ImageFile
    board : Board
    detector : Detector
    refine : 'none', 'subpix' or 'model', optional
        By default 'model' where the detector finds corners of a checkerboard.
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
    if refine is None:
        refine = "model" if detector.feature == "corner" else "none"
    if refine == "model":
        prepare()  # loads the compiled fit while the first images are read

    def look(file: ImageFile) -> Look:
        return _look(file, board, detector, refine)

    with opencv_on_one_thread():
        looks = _in_threads(files, look, jobs, progress, stop)
    return _gathered(looks, board)


def find_board(image: Image, board: Board, detector: Detector, refine: Refine) -> Detection:
    """The board's corners in an image, refined; nothing, with the reason, where they are too few."""
    try:
        found = detector.detect(image, board)
    except Exception as error:  # a stranger's code: one image must not stop the run
        return Detection.nothing(f"the detector {detector.name!r} failed: {error!r}")
    if not len(found):
        return found
    if refine == "subpix":
        found = refine_subpix(image, found)
    elif refine == "model":
        found = refine_by_model(image, found, board)
    if len(found) < MIN_CORNERS:
        reason = f"only {len(found)} of {len(board.points)} corners can be trusted"
        return replace(Detection.nothing(reason), rejected=found.rejected)
    return found


def _look(file: ImageFile, board: Board, detector: Detector, refine: Refine) -> Look:
    try:
        image = read_image(file)
    except InputError as error:
        reason = str(error)
        return Look(View(file.name, Detection.nothing(reason), "unreadable", (Problem("unreadable", reason),)), None)
    detection = find_board(image, board, detector, refine)
    if not len(detection):
        problems: tuple[Problem, ...] = (Problem("no-board", detection.reason),)
        return Look(View(file.name, detection, "no board", problems, image.sha256), image.size)
    problems = problems_of(image, detection, board)
    return Look(View(file.name, detection, "used", problems, image.sha256), image.size)


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
