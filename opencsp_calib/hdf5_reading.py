"""Opening an HDF5 file of anybody's, and reading its datasets: damage and foreign content become one clear sentence."""

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from opencsp_calib.errors import FileFormatError, InputError
from opencsp_calib.seal import check_seal

if TYPE_CHECKING:
    import h5py

__all__ = ["EXTENSIONS", "like_hdf5", "opened", "read_dataset"]

EXTENSIONS = (".h5", ".hdf5", ".hdf")
MAX_VALUES = 50_000_000  # in one dataset; more is a damaged or hostile file
MAX_BYTES = 8 * MAX_VALUES
MAX_CHUNK = 10_000_000  # values that are unpacked together, however few the dataset shows of them
UNEXPECTED = (OSError, LookupError, ValueError, TypeError, RuntimeError, AttributeError, ArithmeticError)
"""What h5py and those who ask it raise over damaged or foreign content."""


def like_hdf5(path: Path) -> bool:
    """Whether a file is HDF5 by its name or its beginning, be the rest damaged or not."""
    import h5py

    return path.suffix.lower() in EXTENSIONS or bool(h5py.is_hdf5(path))


@contextmanager
def opened(path: str | os.PathLike[str]) -> Iterator["h5py.File"]:
    """An HDF5 file, open for reading; whatever is wrong with it ends in an InputError that names it.

    Raises
    ------
    FileFormatError
        If it is damaged or not HDF5, or its content is not what the block expects.
    InputError
        If there is no such file, or it cannot be read.
    """
    path = Path(path)
    with _open(path) as file:
        try:
            yield file
        except InputError as error:
            if str(path) in str(error):
                raise
            raise FileFormatError(f"{path}: {error}") from None
        except UNEXPECTED as error:
            raise FileFormatError(f"{path} is not a camera file, or it is damaged: {_one_line(error)}") from None


def _open(path: Path) -> "h5py.File":
    import h5py

    try:
        if path.is_dir():
            raise InputError(f"{path} is a folder, no camera or observations file")
        if not path.is_file():
            raise InputError(f"no such file: {path}")
        check_seal(path)
    except (OSError, ValueError) as error:  # no permission; a name too long, or with a null
        raise InputError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not h5py.is_hdf5(path):
        if not path.stat().st_size:
            raise FileFormatError(f"{path} is empty: use another copy of it")
        raise FileFormatError(
            f"{path} is not HDF5, as camera and observations files are: it is damaged, or another file is meant"
        )
    try:
        return h5py.File(path, "r")
    except UNEXPECTED as error:
        why = _one_line(error).partition("(")[2].rstrip(")") or _one_line(error)  # "Unable to ... (truncated file)"
        raise FileFormatError(f"{path} is a damaged HDF5 file: use another copy of it ({why})") from None


def read_dataset(group: "h5py.Group", name: str) -> Any:
    """The contents of a dataset that lies within this file and is of a sane size; strings come as str.

    Raises
    ------
    FileFormatError
        If it is missing, is a link to elsewhere, or is too large.
    """
    import h5py

    where = f"{group.file.filename}: {group.name.rstrip('/')}/{name}"
    link = group.get(name, getlink=True)
    if not isinstance(link, h5py.HardLink):
        raise FileFormatError(f"{where} is missing" if link is None else f"{where} is a link, which is not followed")
    dataset = group[name]
    if not isinstance(dataset, h5py.Dataset) or dataset.external or dataset.is_virtual or dataset.shape is None:
        raise FileFormatError(f"{where} is not a dataset of this file's own")
    if dataset.size > MAX_VALUES:
        raise FileFormatError(f"{where} has {dataset.size} values, more than a camera file can need")
    if dataset.nbytes > MAX_BYTES or math.prod(dataset.chunks or ()) > MAX_CHUNK:
        raise FileFormatError(f"{where} takes more memory than a camera file can need")
    if h5py.check_string_dtype(dataset.dtype) is not None:
        return dataset.asstr()[()]
    value = dataset[()]
    if isinstance(value, np.ndarray | np.number):
        return value
    raise FileFormatError(f"{where} has values of an unexpected type")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:200]
