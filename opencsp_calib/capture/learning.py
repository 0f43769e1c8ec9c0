"""The learning itself, in a process of its own, started by `learner.py`.

What it is asked and what it answers are pickles: only the process that started it has the other ends of its pipes. It
stops with its standard input, so that it never outlives the capture.
"""

import copyreg
import pickle
import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

from threadpoolctl import threadpool_limits

from opencsp_calib.coach import Knowledge, learn
from opencsp_calib.detection import View
from opencsp_calib.errors import InputError
from opencsp_calib.images import ImageFile, read_encoded
from opencsp_calib.looking import Look, Search
from opencsp_calib.opencv import opencv_on_one_thread
from opencsp_calib.processes import answers

__all__ = ["Photograph", "Study", "main"]


class Photograph(NamedTuple):
    """One as it is now: after the last one was deleted, the next gets its number, and its name."""

    path: Path
    changed_ns: int

    @classmethod
    def at(cls, path: Path) -> "Photograph":
        """The photograph there; if there is none any more, looking at it will say so."""
        try:
            return cls(path, path.stat().st_mtime_ns)
        except OSError:
            return cls(path, 0)


class Study:
    """Looks at photographs in full, and learns from all of them.

    Parameters
    ----------
    search : Search
    image_size : (int, int)
    range_m, goal_px
        See `opencsp_calib.coach.learn`.
    """

    def __init__(self, search: Search, image_size: tuple[int, int], range_m: float | None, goal_px: float) -> None:
        self._search, self._image_size = search, image_size
        self._learn = partial(learn, search.board, image_size, range_m=range_m, goal_px=goal_px)
        self._views: dict[Photograph, View] = {}
        self.knowledge: Knowledge = self._learn()

    def of(self, photographs: Sequence[Photograph]) -> Knowledge:
        """What these photographs tell, and no others; each is looked at once."""
        self._views = {one: self._views.get(one) or self._view(one.path) for one in photographs}
        self.knowledge = self._learn(tuple(self._views.values()), before=self.knowledge)
        return self.knowledge

    def _view(self, path: Path) -> View:
        try:
            look = self._search.look(read_encoded(ImageFile(path.name, path)))
        except InputError as error:
            look = Look.unreadable(path.name, str(error))
        if look.size not in (None, self._image_size):
            return View(path.name, look.view.detection, "wrong size")
        return look.view


def main() -> None:
    """Answer until standard input ends."""
    asked, told = sys.stdin.buffer, answers("wb")
    copyreg.pickle(MappingProxyType, _pickled)
    with threadpool_limits(1), opencv_on_one_thread():
        study: Study = pickle.load(asked)  # noqa: S301  # from the process that started this one
        while True:
            try:
                photographs = pickle.load(asked)  # noqa: S301
            except EOFError:
                return
            answer: Knowledge | Exception
            try:
                answer = study.of(photographs)
            except Exception as error:
                answer = error
            pickle.dump(answer, told)
            told.flush()


def _pickled(mapping: MappingProxyType[Any, Any]) -> tuple[Any, ...]:
    """How to make it again: a calibration has mappings that cannot be changed, which are not pickled by themselves."""
    return _unchangeable, (dict(mapping),)


def _unchangeable(mapping: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(mapping)
