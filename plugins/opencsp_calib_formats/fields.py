"""What a parsed file holds, asked for by name and type, with errors that say where: ``cam0.cx is missing``."""

import re
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.counted import counted
from opencsp_calib.errors import FileFormatError
from opencsp_calib_formats.safe_text import Repeated

__all__ = ["Fields", "matrix", "number", "numbers", "whole"]

NUMBER = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eEdD][+-]?\d+)?")
MAX_NUMBERS = 2_000_000
MAX_SIDE = 1_000_000  # pixels, as in Camera
MAX_NUMBER = 1e100  # beyond it polynomials overflow
TRUE, FALSE = ("true", "yes", "on", "1"), ("false", "no", "off", "0")


class Fields:
    """A mapping out of a file.

    Parameters
    ----------
    values : mapping
        As `safe_text` and `safe_yaml` give it; anything else is a FileFormatError.
    where : str
        What messages put before a field's name: ``cam0``.

    Raises
    ------
    FileFormatError
        By every method, with the field's name, if the field is missing and has no default, or is not what is asked for.
    """

    def __init__(self, values: Any, where: str = "") -> None:
        if not isinstance(values, Mapping):
            raise FileFormatError(f"{where or 'the file'} holds no named values")
        self.values = values
        self.where = where

    def __contains__(self, name: str) -> bool:
        return name in self.values

    def __iter__(self) -> Iterator[str]:
        return iter(str(key) for key in self.values)

    def path(self, name: str) -> str:
        """How messages call a field."""
        return f"{self.where}.{name}" if self.where else name

    def first(self, *names: str) -> str | None:
        """The first of the names that there is; None if none. ``null`` counts as not being there."""
        return next((name for name in names if self.values.get(name) is not None), None)

    def raw(self, name: str) -> Any:
        """The value as parsed."""
        if name not in self.values:
            raise FileFormatError(f"{self.path(name)} is missing")
        return self.values[name]

    def number(self, name: str, default: float | None = None) -> float:
        """A finite number."""
        if default is not None and self.values.get(name) is None:
            return default
        return number(self.raw(name), self.path(name))

    def positive(self, name: str, default: float | None = None) -> float:
        """A finite number above zero."""
        value = self.number(name, default)
        if not value > 0:
            raise FileFormatError(f"{self.path(name)} is {value:g}, it must be positive")
        return value

    def whole(self, name: str, default: int | None = None) -> int:
        """A whole number."""
        if default is not None and self.values.get(name) is None:
            return default
        return whole(self.raw(name), self.path(name))

    def text(self, name: str, default: str | None = None) -> str:
        """A string."""
        if default is not None and self.values.get(name) is None:
            return default
        value = self.raw(name)
        if not isinstance(value, str):
            raise FileFormatError(f"{self.path(name)} is not text")
        return value.strip()

    def flag(self, name: str, default: bool = False) -> bool:
        """True or false, in any usual spelling."""
        value = self.values.get(name)
        if value is None:
            return default
        word = str(value).strip().lower()
        if word not in TRUE + FALSE:
            raise FileFormatError(f"{self.path(name)} is neither true nor false")
        return word in TRUE

    def numbers(self, name: str, *counts: int) -> Floats:
        """(n,) finite numbers, flattened; n is one of the counts, if any are given."""
        return numbers(self.raw(name), self.path(name), *counts)

    def matrix(self, name: str, rows: int, columns: int) -> Floats:
        """(rows, columns) finite numbers: nested, flat, or as a map of rows, cols and data."""
        return matrix(self.raw(name), self.path(name), rows, columns)

    def fields(self, name: str) -> "Fields":
        """A mapping within."""
        return Fields(self.raw(name), self.path(name))

    def each(self, name: str) -> list["Fields"]:
        """The mappings of a list within."""
        values = self.raw(name)
        if not isinstance(values, list):
            raise FileFormatError(f"{self.path(name)} is not a list")
        return [Fields(value, f"{self.path(name)}[{index}]") for index, value in enumerate(values)]

    def size(self, width: str, height: str) -> tuple[int, int]:
        """An image size of two fields."""
        return _image_size(self.whole(width), self.whole(height), self.where or "the image")

    def size_pair(self, name: str) -> tuple[int, int]:
        """An image size of one field [width, height]."""
        width, height = self.numbers(name, 2)
        return _image_size(whole(width, self.path(name)), whole(height, self.path(name)), self.path(name))


def number(value: Any, what: str) -> float:
    """A finite number, of a number or its text (``1e-05``, ``5.``, Fortran's ``1d0``)."""
    if isinstance(value, str) and NUMBER.fullmatch(value.strip()):
        value = float(value.strip().lower().replace("d", "e"))
    if isinstance(value, bool | Repeated) or not isinstance(value, int | float | np.number):
        raise FileFormatError(f"{what} is {_shown(value)}, not a number")
    try:
        result = float(value)
    except OverflowError:
        result = np.inf
    if not abs(result) <= MAX_NUMBER:
        raise FileFormatError(f"{what} is {_shown(value)}, not a finite number that a camera could have")
    return result


def whole(value: Any, what: str) -> int:
    """A whole number, of a number or its text; ``640.0`` is one."""
    result = number(value, what)
    if result != int(result):
        raise FileFormatError(f"{what} is {result:g}, not a whole number")
    return int(result)


def numbers(value: Any, what: str, *counts: int) -> Floats:
    """(n,) finite numbers of a list, a nested list, a map with ``data``, or a text of numbers between white space."""
    if isinstance(value, Mapping):
        return _counted(_mapped(Fields(value, what))[0], what, counts)
    if isinstance(value, str):
        value = value.replace(",", " ").split()
    flat = [number(item, what) for item in _flat(value, what)]
    return _counted(np.array(flat, dtype=np.float64), what, counts)


def matrix(value: Any, what: str, rows: int, columns: int) -> Floats:
    """(rows, columns) finite numbers of nested or flat lists, or of a map of rows, cols and data."""
    if isinstance(value, Mapping):
        flat, shape = _mapped(Fields(value, what))
        if shape not in (None, (rows, columns)):
            raise FileFormatError(f"{what} is {shape[0]}x{shape[1]}, expected {rows}x{columns}")
    else:
        if isinstance(value, list) and len(value) != rows and any(isinstance(item, list) for item in value):
            raise FileFormatError(f"{what} has {counted(len(value), 'row')}, expected {rows}")
        flat = numbers(value, what)
    return _counted(flat, what, (rows * columns,)).reshape(rows, columns)


def _image_size(width: int, height: int, what: str) -> tuple[int, int]:
    if not (0 < width <= MAX_SIDE and 0 < height <= MAX_SIDE):
        raise FileFormatError(f"{what} has {width}x{height} pixels: no image size")
    return width, height


def _mapped(fields: Fields) -> tuple[Floats, tuple[int, int] | None]:
    """Numbers and shape of a matrix as OpenCV and ROS write it; None where it has no two dimensions."""
    flat = numbers(fields.raw("data"), fields.path("data"))
    if "rows" not in fields or "cols" not in fields:
        return flat, None
    shape = fields.whole("rows"), fields.whole("cols")
    if shape[0] * shape[1] != len(flat):
        raise FileFormatError(
            f"{fields.where} is said to be {shape[0]}x{shape[1]}, but has {counted(len(flat), 'number')}"
        )
    return flat, shape


def _flat(value: Any, what: str) -> Iterator[Any]:
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if not isinstance(value, list | tuple):
        raise FileFormatError(f"{what} is {_shown(value)}, not a list of numbers")
    found = 0
    stack = [iter(value)]
    while stack:
        for item in stack[-1]:
            if isinstance(item, list | tuple):
                stack.append(iter(item))
                break
            found += 1
            if found > MAX_NUMBERS:
                raise FileFormatError(f"{what} has more than {MAX_NUMBERS} numbers")
            yield item
        else:
            stack.pop()


def _counted(flat: Floats, what: str, counts: tuple[int, ...]) -> Floats:
    if counts and len(flat) not in counts:
        raise FileFormatError(f"{what} has {counted(len(flat), 'number')}, expected {' or '.join(map(str, counts))}")
    return flat


def _shown(value: Any) -> str:
    """A value for a message: short, whatever it is."""
    if isinstance(value, Repeated):
        return "there twice with different values"
    if isinstance(value, int) and abs(value) > 2**64:
        return "a huge number"
    if isinstance(value, str | int | float | None):
        return repr(value[:40] if isinstance(value, str) else value)
    return f"a {type(value).__name__}"
