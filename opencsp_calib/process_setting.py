"""A setting of the whole process that some of its threads need for a while."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TypeAlias

__all__ = ["ProcessSetting", "Restore"]

Restore: TypeAlias = Callable[[], object]


class ProcessSetting:
    """A setting of the whole process, changed while anybody is inside: the first changes it, the last restores it.

    Parameters
    ----------
    change : callable
        Makes the change, and returns what takes it back.
    """

    def __init__(self, change: Callable[[], Restore]) -> None:
        self._change = change
        self._lock = threading.Lock()
        self._inside = 0
        self._restore: Restore | None = None

    @contextmanager
    def changed(self) -> Iterator[None]:
        """Changed, then as before."""
        with self._lock:
            if not self._inside:
                self._restore = self._change()
            self._inside += 1
        try:
            yield
        finally:
            with self._lock:
                self._inside -= 1
                if not self._inside and self._restore:
                    self._restore()
