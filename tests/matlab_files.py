"""MATLAB files made byte by byte or by other libraries: structures, and saved objects as MATLAB lays them down."""

import io
import struct
import zlib
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
from numpy.typing import NDArray
from scipy.io import savemat

__all__ = ["CELL", "hdf5", "matrix", "object_file", "structures", "v5"]

INT8, INT32, UINT32, DOUBLE, MATRIX, COMPRESSED, UINT8 = 1, 5, 6, 9, 14, 15, 2
CELL, STRUCT, MX_DOUBLE, MX_UINT8, OPAQUE = 1, 2, 6, 9, 17

Value = NDArray[np.float64] | Mapping[str, "Value"]


def element(kind: int, data: bytes) -> bytes:
    return struct.pack("<II", kind, len(data)) + data + bytes(-len(data) % 8)


def matrix(class_: int, dimensions: tuple[int, ...], name: str, content: bytes) -> bytes:
    parts = element(UINT32, struct.pack("<II", class_, 0))
    parts += element(INT32, struct.pack(f"<{len(dimensions)}i", *dimensions)) + element(INT8, name.encode())
    return element(MATRIX, parts + content)


def of_value(value: object, name: str = "") -> bytes:
    if isinstance(value, Mapping):
        names = b"".join(key.encode().ljust(64, b"\0") for key in value)
        content = element(INT32, struct.pack("<i", 64)) + element(INT8, names)
        return matrix(STRUCT, (1, 1), name, content + b"".join(of_value(item) for item in value.values()))
    if isinstance(value, list):
        return matrix(CELL, (len(value), 1), name, b"".join(of_value(item) for item in value))
    array = np.atleast_2d(np.asarray(value))
    if array.dtype == np.uint8:
        return matrix(MX_UINT8, array.shape, name, element(UINT8, array.tobytes(order="F")))
    return matrix(MX_DOUBLE, array.shape, name, element(DOUBLE, array.astype(float).tobytes(order="F")))


def opaque(name: str, class_: str, content: bytes) -> bytes:
    strings = b"".join(element(INT8, text.encode()) for text in (name, "MCOS", class_))
    return element(MATRIX, element(UINT32, struct.pack("<II", OPAQUE, 0)) + strings + content)


def v5(*elements: bytes, compress: bool = False) -> bytes:
    """A version 5 file of elements."""
    header = b"MATLAB 5.0 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x01IM"
    packed = [struct.pack("<II", COMPRESSED, len(z := zlib.compress(e))) + z if compress else e for e in elements]
    return header + b"".join(packed)


def object_file(cells: list[object], variables: Mapping[str, str], *, compress: bool = True) -> bytes:
    """A file of saved objects: opaque variables (names and classes), and what all objects hold, as cells."""
    wrapper = opaque("", "FileWrapper__", of_value(cells))
    content = element(INT32, struct.pack("<i", 64)) + element(INT8, b"MCOS".ljust(64, b"\0"))
    workspace = b"\x00\x01IM" + bytes(4) + matrix(STRUCT, (1, 1), "", content + wrapper)
    parts = [opaque(name, class_, of_value(np.zeros((6, 1)))) for name, class_ in variables.items()]
    return v5(*parts, of_value(np.frombuffer(workspace, dtype=np.uint8)[None]), compress=compress)


def structures(variables: Mapping[str, object]) -> bytes:
    """A version 5 file of structures, by scipy."""
    buffer = io.BytesIO()
    savemat(buffer, dict(variables), do_compression=True)
    return buffer.getvalue()


def hdf5(path: Path, variables: Mapping[str, object]) -> Path:
    """A version 7.3 file: HDF5 behind 512 bytes, every array transposed."""
    with h5py.File(path, "w", userblock_size=512) as file:
        _fill(file, variables)
    data = path.read_bytes()
    path.write_bytes(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(116) + bytes(8) + b"\x00\x02IM" + data[128:])
    return path


def _fill(group: h5py.Group, values: Mapping[str, object]) -> None:
    for key, value in values.items():
        if isinstance(value, Mapping):
            inner = group.create_group(key)
            inner.attrs["MATLAB_class"] = np.bytes_("struct")
            _fill(inner, value)
        elif isinstance(value, str):
            codes = np.array([[ord(letter)] for letter in value], dtype=np.uint16)
            group[key] = codes
            group[key].attrs["MATLAB_class"] = np.bytes_("char")
        else:
            group[key] = np.atleast_2d(np.asarray(value, dtype=float)).T
            group[key].attrs["MATLAB_class"] = np.bytes_("double")
