"""MATLAB's version 7.3 .mat files: HDF5 behind 512 bytes of text, arrays stored column by column.

h5py therefore sees every array transposed; it is turned back here. Cells are references to entries of ``#refs#``, where
saved objects keep their data too. Datasets are read only up to a size no camera reaches.
"""

import math
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib.errors import FileFormatError
from opencsp_calib_formats.mat_v5 import Opaque

__all__ = ["read_mat_hdf5"]

MAX_VALUES = 100_000  # of one dataset; larger ones are left out
MAX_CHUNK = 10_000_000  # values that are unpacked together
MAX_ENTRIES = 20_000  # of a file
MAX_DEPTH = 8
INTERNAL = {"#refs#": "objects", "#subsystem#": ""}


def read_mat_hdf5(path: Path) -> dict[str, Any]:
    """The variables of a version 7.3 file, as `mat_file.read_mat` gives them.

    Raises
    ------
    FileFormatError
    """
    import h5py

    try:
        with h5py.File(path, "r") as file:
            return _Walk(h5py).group(file, 0)
    except FileFormatError:
        raise
    except Exception as error:  # h5py raises whatever it likes on damaged files
        raise FileFormatError(f"damaged HDF5 file: {error}") from None


class _Walk:
    """One way through a file, which ends when it has seen too much."""

    def __init__(self, h5py: Any) -> None:
        self._h5py = h5py
        self._seen = 0

    def group(self, group: Any, depth: int) -> dict[str, Any]:
        """The entries of a group; of MATLAB's own two, only the saved objects."""
        values = {}
        for key in group:
            name = INTERNAL.get(key, key) if depth == 0 else key
            if name and group.get(key, getlink=True).__class__.__name__ == "HardLink":
                value = self._entry(group[key], depth + 1)
                if value is not None:
                    values[str(name)] = value
        return values

    def _entry(self, entry: Any, depth: int) -> Any:
        self._seen += 1
        if self._seen > MAX_ENTRIES or depth > MAX_DEPTH:
            raise FileFormatError("too many or too deeply nested entries: not a camera file")
        if isinstance(entry, self._h5py.Group):
            return self.group(entry, depth)
        if not isinstance(entry, self._h5py.Dataset):
            return None
        return self._dataset(entry, depth)

    def _dataset(self, entry: Any, depth: int) -> Any:
        if entry.size is None or self._attribute(entry, "MATLAB_empty"):
            return np.zeros((0, 0))
        if entry.size > MAX_VALUES or entry.external or math.prod(entry.chunks or ()) > MAX_CHUNK:
            return None
        if self._attribute(entry, "MATLAB_object_decode"):
            return Opaque(entry.name.strip("/"), "", None)
        if self._h5py.check_ref_dtype(entry.dtype) is not None:
            file = entry.file
            return [self._entry(file[reference], depth + 1) for reference in np.ravel(entry[()]) if reference]
        if entry.dtype.kind not in "iuf":
            return None
        value = np.asarray(entry[()]).T
        if self._attribute(entry, "MATLAB_class") == b"char":
            return "".join(chr(int(code)) for code in value.T.ravel() if 0 <= code < 0x110000)
        return value

    def _attribute(self, entry: Any, name: str) -> Any:
        """An attribute of fixed size, as MATLAB's are, or None: damaged ones of variable length end the process."""
        if name not in entry.attrs:
            return None
        kind = entry.attrs.get_id(name).dtype
        return entry.attrs[name] if kind.kind in "iuSb" else None
