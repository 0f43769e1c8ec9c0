"""Machine code for the loops of the renderer."""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from numba import njit

__all__ = ["compiled"]

P = ParamSpec("P")
T = TypeVar("T")


def compiled(function: Callable[P, T]) -> Callable[P, T]:
    """The function as machine code, made at its first call, which lets other threads run meanwhile.

    The code is kept on disk for the next process, where there is a place to write to: an installation may be
    read-only, and its user without a home.
    """
    options = {"nogil": True, "error_model": "numpy"}
    try:
        made: Callable[P, T] = njit(cache=True, **options)(function)
    except RuntimeError:  # numba: no locator available
        made = njit(**options)(function)
    return made
