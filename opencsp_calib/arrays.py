"""Array types by meaning, and the one check of shape and finiteness."""

from collections.abc import Sequence
from functools import lru_cache
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from opencsp_calib.errors import InputError

__all__ = [
    "Covariances",
    "Floats",
    "Ids",
    "Mask",
    "Matrix",
    "Params",
    "Pixels",
    "Points",
    "Vector",
    "checked",
    "frozen",
    "frozen_ids",
    "frozen_mask",
]

Floats: TypeAlias = NDArray[np.float64]
Pixels: TypeAlias = NDArray[np.float64]  # (N, 2) x, y; the centre of the upper-left pixel is (0, 0)
Points: TypeAlias = NDArray[np.float64]  # (N, 3) metres
Params: TypeAlias = NDArray[np.float64]  # (P,) fx fy cx cy, then distortion
Matrix: TypeAlias = NDArray[np.float64]  # (M, N)
Vector: TypeAlias = NDArray[np.float64]  # (3,)
Covariances: TypeAlias = NDArray[np.float64]  # (N, 2, 2) pixels squared
Ids: TypeAlias = NDArray[np.int64]  # (N,)
Mask: TypeAlias = NDArray[np.bool_]  # (N,)


def checked(value: ArrayLike, name: str, shape: Sequence[int | None], *, finite: bool = True) -> Floats:
    """Value as a float64 array of the given shape.

    Parameters
    ----------
    value : array_like
        What was given.
    name : str
        What the message calls it.
    shape : sequence of int or None
        The expected shape; None stands for any length.
    finite : bool
        Whether NaN and infinity are refused.

    Returns
    -------
    array, float64
        Maybe the same memory as `value`.

    Raises
    ------
    InputError
        With a message such as ``params has shape (3,), expected (9,)``.
    """
    try:
        array = np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} is not an array of numbers: {error}") from None
    _check_shape(array.shape, name, shape)
    if finite and not np.isfinite(array).all():
        lost = np.count_nonzero(~np.isfinite(array))
        raise InputError(f"{name} has NaN or infinity in {lost} of {array.size} values")
    return array


def frozen(value: ArrayLike, name: str, shape: Sequence[int | None], *, finite: bool = True) -> Floats:
    """Like `checked`, as a read-only copy; one that is given comes back as it is."""
    array = checked(value, name, shape, finite=finite)
    return array if _is_frozen(array) else _read_only(array.copy())


def frozen_ids(value: ArrayLike, name: str, shape: Sequence[int | None]) -> Ids:
    """A read-only copy as int64, or what is given if it is one; fractions are refused.

    All that count 0, 1, 2 ... are one: most views see the whole of a board, and need no array of their own for that.
    """
    array = np.asarray(value)
    ids = array.astype(np.int64, copy=False)
    _check_shape(ids.shape, name, shape)
    if array.dtype.kind not in "iu" and not np.array_equal(ids, array):
        raise InputError(f"{name} must be whole numbers")
    counted = _counted(ids.size)
    if np.array_equal(ids, counted):
        return counted
    return ids if _is_frozen(ids) else _read_only(ids.copy())


def frozen_mask(value: ArrayLike, name: str, shape: Sequence[int | None]) -> Mask:
    """A read-only copy as bool; one that is given comes back as it is."""
    mask = np.asarray(value, dtype=np.bool_)
    _check_shape(mask.shape, name, shape)
    return mask if _is_frozen(mask) else _read_only(mask.copy())


@lru_cache(maxsize=4)
def _counted(count: int) -> Ids:
    return _read_only(np.arange(count, dtype=np.int64))


def _check_shape(shape: tuple[int, ...], name: str, expected: Sequence[int | None]) -> None:
    fits = len(shape) == len(expected) and all(e in (None, s) for s, e in zip(shape, expected, strict=True))
    if not fits:
        letters = iter("NMLK")
        wanted = ", ".join(next(letters) if e is None else str(e) for e in expected)
        raise InputError(f"{name} has shape {shape}, expected ({wanted}{',' if len(expected) == 1 else ''})")


def _is_frozen(array: NDArray) -> bool:  # type: ignore[type-arg]  # any dtype
    return array.base is None and not array.flags.writeable


def _read_only(array: NDArray) -> NDArray:  # type: ignore[type-arg]  # any dtype in, the same dtype out
    array.flags.writeable = False
    return array
