"""Works out in the background what the photographs taken so far tell, while the live picture goes on."""

from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path

from opencsp_calib.board import Board
from opencsp_calib.coach import Knowledge, learn
from opencsp_calib.detection import View
from opencsp_calib.errors import InputError
from opencsp_calib.images import ImageFile, read_encoded
from opencsp_calib.looking import Look, Search

__all__ = ["Learner"]


class Learner:
    """Looks at photographs in full, and learns from all of them; one thread, and always the latest state of the set.

    Parameters
    ----------
    search : Search
    image_size : (int, int)
    range_m, goal_px
        See `opencsp_calib.coach.learn`.
    """

    def __init__(self, search: Search, image_size: tuple[int, int], range_m: float | None, goal_px: float) -> None:
        self._search, self._image_size = search, image_size
        self._learn = partial(learn, range_m=range_m, goal_px=goal_px)
        self._views: dict[Path, View] = {}
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="learn")
        self._running: Future[Knowledge] | None = None
        self._wanted: tuple[Path, ...] = ()
        self._started: tuple[Path, ...] = ()
        self.knowledge = self._learn(self.board, image_size)

    @property
    def board(self) -> Board:
        """That is looked for."""
        return self._search.board

    @property
    def behind(self) -> bool:
        """Whether there are photographs that `knowledge` does not know of yet."""
        self._advance()
        return self._running is not None

    def know(self, photographs: Sequence[Path]) -> None:
        """Learn from these photographs, and no others, as soon as what is running is done."""
        self._wanted = tuple(photographs)
        self._advance()

    def wait(self) -> Knowledge:
        """Until it is not behind any more."""
        while self.behind:
            assert self._running is not None  # noqa: S101  # behind says so
            self._running.exception()
        return self.knowledge

    def close(self) -> None:
        """Stop; what is running comes to its end, but is not waited for."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def _advance(self) -> None:
        if self._running is not None and self._running.done():
            self.knowledge = self._running.result()
            self._running = None
        if self._running is None and self._wanted != self._started:
            self._started = self._wanted
            self._running = self._pool.submit(self._learned, self._wanted)

    def _learned(self, photographs: tuple[Path, ...]) -> Knowledge:
        self._views = {path: self._views.get(path) or self._view(path) for path in photographs}
        return self._learn(self.board, self._image_size, tuple(self._views.values()), before=self.knowledge)

    def _view(self, path: Path) -> View:
        try:
            look = self._search.look(read_encoded(ImageFile(path.name, path)))
        except InputError as error:
            look = Look.unreadable(path.name, str(error))
        if look.size not in (None, self._image_size):
            return View(path.name, look.view.detection, "wrong size")
        return look.view
