"""MATLAB's .mat files of every version, as plain dictionaries, lists, arrays and strings; no class is ever made.

Version 5 is read by scipy, after `mat_elements` has unpacked it and checked that nothing in it claims more than there
is; version 7.3 is HDF5 (`mat_hdf5`). A saved object is not a variable of its own: its variable is opaque, and the data
of all objects of a file is one nameless array of bytes, within which lies another .mat stream. Its cells are given
under the name `OBJECTS`.
"""

import contextlib
import warnings
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib.errors import FileFormatError
from opencsp_calib_formats.mat_elements import check_stream, unpacked
from opencsp_calib_formats.mat_hdf5 import read_mat_hdf5
from opencsp_calib_formats.safe_text import read_bytes

__all__ = ["OBJECTS", "is_mat", "read_mat"]

OBJECTS = "objects"
WORKSPACE = "__function_workspace__"  # scipy's name for an array without one
MAX_BYTES = 64 * 2**20
MAX_DEPTH = 12


def is_mat(path: Path) -> bool:
    """Whether a file is a .mat file of version 5 or 7.3; never raises."""
    try:
        with path.open("rb") as file:
            start = file.read(520)
    except OSError:
        return False
    return start.startswith(b"MATLAB ") or (len(start) >= 128 and start[126:128] in (b"IM", b"MI"))


def read_mat(path: Path) -> dict[str, Any]:
    """The variables of a .mat file, in MATLAB's orientation: arrays (rows, columns).

    Raises
    ------
    FileFormatError
        If it is none, is damaged, or claims more than there is in it.
    """
    data = read_bytes(path, MAX_BYTES)
    if b"\x89HDF\r\n\x1a\n" in (data[:8], data[512:520]):
        return read_mat_hdf5(path)
    if len(data) >= 128 and data[126:128] in (b"IM", b"MI"):
        data = unpacked(data)
    variables = _loaded(data)
    workspace = variables.pop(WORKSPACE, None)
    plain = {_name(key, value): _plain(value) for key, value in variables.items() if not key.startswith("__")}
    if isinstance(workspace, np.ndarray) and workspace.dtype == np.uint8:
        plain[OBJECTS] = _objects(workspace.tobytes(order="F"))
    return plain


@contextlib.contextmanager
def _as_ours() -> Iterator[None]:
    """Whatever a library raises on damaged bytes is a damaged file."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except FileFormatError:
        raise
    except Exception as error:
        raise FileFormatError(f"damaged .mat file: {error}") from None


def _loaded(data: bytes) -> dict[str, Any]:
    from scipy.io import loadmat

    with _as_ours():
        return dict(loadmat(BytesIO(data)))


def _objects(data: bytes) -> Any:
    """What the saved objects of a file hold: the elements of its function workspace, read as a file of their own."""
    if len(data) < 16 or data[2:4] not in (b"IM", b"MI"):
        return []
    check_stream(data, 8, "<" if data[2:4] == b"IM" else ">")  # after version and byte order
    inner = _loaded(b"MATLAB".ljust(124) + data[:4] + data[8:])
    return [_plain(value) for key, value in inner.items() if key == WORKSPACE or not key.startswith("__")]


def _name(key: str, value: Any) -> str:
    """A variable's name; scipy gives opaque ones none, but keeps theirs in the first field."""
    names = getattr(getattr(value, "dtype", None), "names", None) or ()
    if "s0" in names and value.size:
        first = value.ravel()[0]["s0"]
        return first.decode("latin-1") if isinstance(first, bytes) else str(first)
    return key


def _plain(value: Any, depth: int = 0) -> Any:
    """Structures as dictionaries (many as lists of them), cells as lists, characters as strings."""
    if not isinstance(value, np.ndarray):
        return value
    if depth > MAX_DEPTH:
        raise FileFormatError(f"nested more than {MAX_DEPTH} deep: not a camera file")
    if value.dtype.names:
        entries = [{name: _plain(entry[name], depth + 1) for name in value.dtype.names} for entry in value.ravel()]
        return entries[0] if len(entries) == 1 else entries
    if value.dtype == object:
        return [_plain(item, depth + 1) for item in value.ravel()]
    if value.dtype.kind == "U":
        return "".join(value.ravel().tolist())
    return np.asarray(value)
