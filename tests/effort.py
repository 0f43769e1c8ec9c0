"""Limits of effort that mean the same on a slow machine and on a fast one."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from statistics import median

PIECE_S = 0.02
"""What the piece of work below takes on the machine for which limits are written."""


@contextmanager
def at_most(seconds: float) -> Iterator[None]:
    """So much time of the processor, for this thread alone, and more on a slower machine in proportion."""
    begin = time.thread_time()
    yield
    taken_s = time.thread_time() - begin
    assert taken_s < seconds * _slowness()


@cache
def _slowness() -> float:
    return max(1.0, median(_piece_s() for _ in range(7)) / PIECE_S)


def _piece_s() -> float:
    begin = time.thread_time()
    sum(len(str(number)) for number in range(100_000))
    return time.thread_time() - begin
