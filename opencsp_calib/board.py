"""The calibration target: which corners it has, and where they are."""

import math
import re
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike
from typing_extensions import Self

from opencsp_calib.arrays import Points, frozen
from opencsp_calib.errors import BoardSpecError

__all__ = ["Board", "CharucoBoard", "Checkerboard", "RecordedBoard", "format_length", "parse_length"]

UNITS_M = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "in": 0.0254}
MAX_CORNERS = 100_000


@dataclass(frozen=True, eq=False)
class Board:
    """Corners with ids, and their positions on the board. What boards are used for is in its subclasses.

    A corner's id is its index in `points`: row by row, columns fastest; x along the columns, y along the rows, z = 0
    on a flat board, the origin at id 0.

    Parameters
    ----------
    columns, rows : int
        As its kind counts them.
    spacing_m : float
        Distance between neighbouring corners, metres.
    points : (K, 3) m, optional
        Where the corners are, as measured or as solved; by default flat and evenly spaced.

    Raises
    ------
    BoardSpecError
        If there are too few or too many corners, or the spacing is not positive.
    """

    columns: int
    rows: int
    spacing_m: float
    points: Points = field(default=None, kw_only=True, repr=False)  # type: ignore[arg-type]  # filled below

    kind: ClassVar[str] = "board"

    def __post_init__(self) -> None:
        columns, rows = self.grid
        if min(columns, rows) < 1 or columns * rows > MAX_CORNERS:
            raise BoardSpecError(
                f"a {self.kind} of {self.columns}x{self.rows} cannot be used: boards have 1 to {MAX_CORNERS} corners"
            )
        if not (math.isfinite(self.spacing_m) and self.spacing_m > 0):
            raise BoardSpecError(f"the spacing of a board's corners must be positive, not {self.spacing_m} m")
        points = self.nominal_points if self.points is None else self.points
        object.__setattr__(self, "points", frozen(points, "board points", (columns * rows, 3)))

    @property
    def grid(self) -> tuple[int, int]:
        """Columns and rows of corners."""
        return self.columns, self.rows

    @property
    def spec(self) -> str:
        """The one-line description, as typed on the command line, that makes this board with nominal points."""
        return f"{self.kind}:{self.columns}x{self.rows}:{format_length(self.spacing_m)}"

    @property
    def symmetric(self) -> bool:
        """Whether it looks the same upside down, so that a photograph does not tell its two ends apart."""
        return False

    @property
    def nominal_points(self) -> Points:
        """(K, 3) m, flat and evenly spaced."""
        columns, rows = self.grid
        y, x = np.mgrid[:rows, :columns]
        return np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * self.spacing_m

    def with_points(self, points: ArrayLike) -> Self:
        """The same board with its corners at (K, 3) m: as measured, or as solved."""
        return replace(self, points=np.asarray(points, dtype=np.float64))

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Board):
            return NotImplemented
        return self.spec == other.spec and np.array_equal(self.points, other.points)

    __hash__ = None  # type: ignore[assignment]  # holds an array


@dataclass(frozen=True, eq=False)
class Checkerboard(Board):
    """A plain checkerboard; columns and rows are its *inner* corners, one less than its squares each way."""

    kind: ClassVar[str] = "checkerboard"

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3:
            raise BoardSpecError(
                f"a checkerboard needs at least 3 inner corners each way, not {self.columns}x{self.rows}"
            )
        super().__post_init__()

    @property
    def symmetric(self) -> bool:
        """See `Board.symmetric`: so where columns and rows are both even or both odd."""
        return (self.columns + self.rows) % 2 == 0


@dataclass(frozen=True, eq=False)
class CharucoBoard(Board):
    """A checkerboard with an ArUco marker in every white square; columns and rows are *squares*, as OpenCV counts.

    Its corners are the inner corners of the checkerboard, numbered as OpenCV does.

    Parameters
    ----------
    columns, rows, spacing_m, points
        See `Board`.
    marker_m : float
        Side of a marker, metres.
    dictionary : str
        Such as ``DICT_4X4_50``.
    inverted : bool
        Printed white on black.
    legacy : bool
        OpenCV's layout before 4.6, which begins with a white square where the number of rows is even.
    """

    marker_m: float
    dictionary: str
    inverted: bool = False
    legacy: bool = False

    kind: ClassVar[str] = "charuco"

    def __post_init__(self) -> None:
        if min(self.columns, self.rows) < 3:
            raise BoardSpecError(f"a ChArUco board needs at least 3 squares each way, not {self.columns}x{self.rows}")
        if not 0 < self.marker_m < self.spacing_m:
            raise BoardSpecError(
                f"a ChArUco board's marker ({format_length(self.marker_m)}) must be smaller than its square "
                f"({format_length(self.spacing_m)}); give the square's size first"
            )
        super().__post_init__()

    @property
    def grid(self) -> tuple[int, int]:
        """Columns and rows of corners: one less than squares."""
        return self.columns - 1, self.rows - 1

    @property
    def spec(self) -> str:
        """See `Board.spec`."""
        flags = ":inverted" * self.inverted + ":legacy" * self.legacy
        return f"{super().spec}:{format_length(self.marker_m)}:{self.dictionary}{flags}"


@dataclass(frozen=True, eq=False)
class RecordedBoard(Board):
    """A board of a kind that is known by name only, as a file recorded it: it can be solved with, not looked for."""

    recorded_spec: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "kind", self.recorded_spec.partition(":")[0])
        super().__post_init__()

    @property
    def spec(self) -> str:
        """See `Board.spec`."""
        return self.recorded_spec


def parse_length(text: str) -> float:
    """Metres, of a length with its unit, such as ``50mm``, ``5 cm``, ``0.05m`` or ``2in``.

    Raises
    ------
    BoardSpecError
        If there is no unit, or it is not a positive length.
    """
    match = re.fullmatch(r"\s*([0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]+)?)\s*([a-z]*)\s*", text)
    if not match:
        raise BoardSpecError(f"{text!r} is not a length; write it like 50mm")
    number, unit = match.groups()
    if unit not in UNITS_M:
        said = f"has the unknown unit {unit!r}" if unit else "has no unit"
        raise BoardSpecError(f"the length {text.strip()!r} {said}; write it with mm, cm, m or in, like 50mm")
    length = float(number) * UNITS_M[unit]
    if not 1e-6 <= length < 1e4:
        raise BoardSpecError(f"{text!r} is not a usable length; write it like 50mm")
    return length


def format_length(metres: float) -> str:
    """A length as people write it, in millimetres; `parse_length` gives the very same number back."""
    text = f"{metres * 1e3:.12g}mm"
    exact = math.isfinite(metres) and metres > 0 and parse_length(text) == metres
    return text if exact else f"{metres!r}m"
