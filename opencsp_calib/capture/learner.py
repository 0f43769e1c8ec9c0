"""Has worked out in the background what the photographs taken so far tell, while the live picture goes on.

In a process of its own: its many small steps would take Python's lock from the thread that looks at the frames. Not in
one of a `ProcessPoolExecutor`, which cannot be ended in mid-work, outlives a killed capture, and imports a person's
script a second time.
"""

import pickle
import subprocess
from collections.abc import Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any

from opencsp_calib.capture.learning import Photograph, Study
from opencsp_calib.coach import Knowledge
from opencsp_calib.errors import CalibError
from opencsp_calib.processes import BACKGROUND, own_process

__all__ = ["Learner"]


class Learner:
    """Learns from photographs, always from the latest state of the set.

    Parameters
    ----------
    study : Study
        That looks at them and learns, in the other process.
    """

    def __init__(self, study: Study) -> None:
        self._process = subprocess.Popen(  # noqa: S603  # our own module
            own_process("opencsp_calib.capture.learning", background=True),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            **BACKGROUND,
        )
        self._waiting = ThreadPoolExecutor(1, thread_name_prefix="learn")
        self._running: Future[Knowledge] | None = None
        self._wanted: tuple[Photograph, ...] = ()
        self._started: tuple[Photograph, ...] = ()
        self.knowledge = study.knowledge
        self._tell(study)

    @property
    def behind(self) -> bool:
        """Whether there are photographs that `knowledge` does not know of yet."""
        self._advance()
        return self._running is not None

    def know(self, photographs: Sequence[Path]) -> None:
        """Learn from these photographs, and no others, as soon as what is running is done."""
        self._wanted = tuple(map(Photograph.at, photographs))
        self._advance()

    def wait(self) -> Knowledge:
        """Until it is not behind any more."""
        while self.behind:
            assert self._running is not None  # noqa: S101  # behind says so
            self._running.exception()
        return self.knowledge

    def close(self) -> None:
        """Stop, whatever is running."""
        self._process.terminate()
        self._waiting.shutdown(cancel_futures=True)  # what waits for an answer is told that there is none
        with suppress(OSError):  # it would still write what the process never read
            self._process.communicate()

    def _advance(self) -> None:
        if self._running is not None and self._running.done():
            self.knowledge = self._running.result()
            self._running = None
        if self._running is None and self._wanted != self._started:
            self._started = self._wanted
            self._running = self._waiting.submit(self._learned, self._wanted)

    def _learned(self, photographs: tuple[Photograph, ...]) -> Knowledge:
        assert self._process.stdout is not None  # noqa: S101  # a pipe was asked for
        self._tell(photographs)
        try:
            answer = pickle.load(self._process.stdout)  # noqa: S301  # our own process
        except (EOFError, pickle.UnpicklingError):  # also in the middle of its answer
            raise CalibError("the coach's process ended unexpectedly (out of memory?)") from None
        if isinstance(answer, Exception):
            raise answer
        assert isinstance(answer, Knowledge)  # noqa: S101
        return answer

    def _tell(self, what: Any) -> None:
        assert self._process.stdin is not None  # noqa: S101  # a pipe was asked for
        with suppress(BrokenPipeError):  # it has died: its answer, which is none, says so
            pickle.dump(what, self._process.stdin)
            self._process.stdin.flush()
