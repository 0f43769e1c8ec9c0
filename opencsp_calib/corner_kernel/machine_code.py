"""How the parts of the kernel become machine code. Importing this imports Numba: see `opencsp_calib.compiled`.

Loops over pixels count with `unsigned`: an index that might be negative is looked at each time, as Python counts such
from the end, and then the loop does one pixel at a time instead of four.
"""

from collections.abc import Callable
from typing import ParamSpec, TypeVar

import numpy as np
from numba import njit

__all__ = ["exact", "fast", "unsigned"]

P = ParamSpec("P")
T = TypeVar("T")

unsigned = np.uint64


def exact(function: Callable[P, T]) -> Callable[P, T]:
    """Arithmetic as NumPy's, also in its way to divide: looking for a zero each time keeps loops from vectorising."""
    made: Callable[P, T] = njit(nogil=True, error_model="numpy")(function)
    return made


def fast(function: Callable[P, T]) -> Callable[P, T]:
    """Sums may be taken in any order; NaN and infinity keep their meaning."""
    options = {"reassoc", "contract", "nsz", "arcp"}
    made: Callable[P, T] = njit(nogil=True, error_model="numpy", fastmath=options)(function)
    return made
