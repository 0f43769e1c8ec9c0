"""The compiled part of opencsp-calib: loops over pixels, written in C and compiled when it is installed.

Its sources are in the folder `native` beside the package. Calls let other threads run meanwhile.
"""

import ctypes
import hashlib
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib.errors import MissingDependencyError

__all__ = ["array_of", "native_function", "result_of"]

SOURCES = Path(__file__).parents[1] / "native"  # in a checkout; elsewhere the library cannot be of another version
SUFFIX = {"win32": ".dll", "darwin": ".dylib"}.get(sys.platform, ".so")
AGAIN = "install opencsp-calib again (with pip, or make in a checkout)"


def native_function(name: str, *arguments: Any) -> Callable[..., None]:
    """A function of the compiled part, in the quickest form that this processor can run.

    Parameters
    ----------
    name : str
    *arguments : ctypes type, `array_of` or `result_of`
        What it takes; a call with anything else raises ctypes.ArgumentError.

    Raises
    ------
    MissingDependencyError
        If the compiled part is not there.
    """
    function = _library()[name]  # not as an attribute, which would be one for all that it may take
    function.argtypes, function.restype = arguments, None
    made: Callable[..., None] = function
    return made


def array_of(dtype: type[np.generic], dimensions: int) -> Any:
    """An array that is read: its numbers lie one after another, the last axis fastest."""
    return _address_of(np.ctypeslib.ndpointer(dtype, dimensions, flags="C_CONTIGUOUS"))


def result_of(dtype: type[np.generic], dimensions: int) -> Any:
    """An array that is written to, in the same order."""
    return _address_of(np.ctypeslib.ndpointer(dtype, dimensions, flags=("C_CONTIGUOUS", "WRITEABLE")))


def _address_of(kind: Any) -> Any:
    """What NumPy makes of an argument refers to itself: megabytes of it would await Python's search for cycles."""

    class Address(kind):  # type: ignore[misc]  # made when the program runs
        @classmethod
        def from_param(cls, array: Any) -> ctypes.c_void_p:
            return ctypes.c_void_p(super().from_param(array).data)

    return Address


@cache
def _library() -> ctypes.CDLL:
    plain = _load("")
    return _load("_avx2") if plain.has_avx2() else plain


def _load(variant: str) -> ctypes.CDLL:
    file = Path(__file__).with_name(f"_native{variant}{SUFFIX}")
    try:
        library = ctypes.CDLL(str(file))
    except OSError as error:
        raise MissingDependencyError(
            f"the compiled part of opencsp-calib cannot be loaded ({error}): {AGAIN}"
        ) from None
    if (SOURCES / "build_hook.py").exists() and _made_of(library) != _sources():
        raise MissingDependencyError(f"the compiled part of opencsp-calib is older than its sources: {AGAIN}")
    return library


def _made_of(library: ctypes.CDLL) -> bytes:
    """The SHA-256 of what a library was made of, hexadecimal; nothing where it is too old to say."""
    try:
        made_of = library.made_of
    except AttributeError:
        return b""
    made_of.restype = ctypes.c_char_p
    said: bytes = made_of()
    return said


def _sources() -> bytes:
    """The SHA-256 of the sources that are there now, hexadecimal."""
    code = b"".join(file.read_bytes() for file in sorted(SOURCES.glob("*.[ch]")))
    return hashlib.sha256(code).hexdigest().encode()
