"""MATLAB's .mat files of version 5 and 7.3, as plain dictionaries, lists, arrays and strings; no class is ever made.

A saved object is not a variable of its own: its variable is opaque, and the data of all objects of a file is one
nameless array of bytes, within which lies another stream of elements. What that holds is given under the name
`OBJECTS`, next to the opaque variables.
"""

from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib.errors import FileFormatError
from opencsp_calib_formats.mat_hdf5 import read_mat_hdf5
from opencsp_calib_formats.mat_v5 import elements
from opencsp_calib_formats.safe_text import read_bytes

__all__ = ["OBJECTS", "is_mat", "read_mat"]

OBJECTS = "objects"
MAX_BYTES = 64 * 2**20
BYTE_ORDER = {b"IM": "<", b"MI": ">"}


def is_mat(path: Path) -> bool:
    """Whether a file is a .mat file of version 5 or 7.3; never raises."""
    try:
        with path.open("rb") as file:
            start = file.read(128)
    except (OSError, ValueError):
        return False
    return len(start) == 128 and start[126:128] in BYTE_ORDER


def read_mat(path: Path) -> dict[str, Any]:
    """The variables of a .mat file, in MATLAB's orientation: arrays (rows, columns). See `mat_v5.elements`.

    Raises
    ------
    FileFormatError
        If it is none, is damaged, or claims more than there is in it.
    """
    data = read_bytes(path, MAX_BYTES)
    if data[512:520] == b"\x89HDF\r\n\x1a\n":
        return read_mat_hdf5(path)
    if len(data) < 128 or data[126:128] not in BYTE_ORDER:
        raise FileFormatError("not a .mat file of version 5 or 7.3")
    variables: dict[str, Any] = {}
    for name, value in elements(data, 128, BYTE_ORDER[data[126:128]]):
        if name:
            variables[name] = value
        elif isinstance(value, np.ndarray) and value.dtype.itemsize == 1:
            variables[OBJECTS] = _objects(value.tobytes(order="F"))
    return variables


def _objects(data: bytes) -> list[Any]:
    """What the saved objects of a file hold."""
    if len(data) < 16 or data[2:4] not in BYTE_ORDER:
        return []
    return [value for _, value in elements(data, 8, BYTE_ORDER[data[2:4]])]  # 8: version, byte order, nothing
