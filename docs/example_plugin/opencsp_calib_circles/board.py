"""The board: a symmetric grid of black discs. Its "corners" are their centres."""

import math
import re
from dataclasses import dataclass
from typing import ClassVar

from opencsp_calib.board import Board, format_length, parse_length
from opencsp_calib.errors import BoardSpecError
from opencsp_calib.interfaces import Drawing, Rectangle

STRIPS = 32  # that a disc is drawn with: a drawing is made of rectangles


@dataclass(frozen=True, eq=False)
class CircleGrid(Board):
    """Columns x rows of discs."""

    diameter_m: float

    kind: ClassVar[str] = "circles"

    def __post_init__(self):
        if min(self.columns, self.rows) < 3 or self.columns == self.rows:
            raise BoardSpecError("a circle grid needs 3 circles each way at least, and not as many rows as columns")
        if not 0 < self.diameter_m < 0.9 * self.spacing_m:
            raise BoardSpecError("circles must be smaller than nine tenths of their spacing; give the spacing first")
        super().__post_init__()

    @property
    def spec(self):
        """The description that makes this board again."""
        return f"{super().spec}:{format_length(self.diameter_m)}"

    @property
    def symmetric(self):
        """It looks the same upside down."""
        return True


class CircleGridKind:
    """`circles:11x7:30mm:14mm`."""

    name = "circles"
    grammar = "circles:COLUMNSxROWS:SPACING:DIAMETER"

    def missing(self):
        """Nothing ever is."""

    def parse(self, spec):
        """The board of a description."""
        match = re.fullmatch(r"circles:([0-9]{1,4})x([0-9]{1,4}):([^:]+):([^:]+)", spec)
        if not match:
            raise BoardSpecError(f"{spec!r} is no circle grid; write {self.grammar}, such as circles:11x7:30mm:14mm")
        columns, rows, spacing, diameter = match.groups()
        try:
            return CircleGrid(int(columns), int(rows), parse_length(spacing), diameter_m=parse_length(diameter))
        except BoardSpecError as error:
            raise BoardSpecError(f"{spec!r}: {error}; write {self.grammar}") from None

    def draw(self, board):
        """How it is printed: each disc in strips, on a page with half a spacing around the outermost centres."""
        pitch, half = board.spacing_m, board.spacing_m / 2
        strips = [
            Rectangle(x + half - width / 2, y + half + top, width, height)
            for x, y, _ in board.nominal_points
            for top, width, height in _disc(board.diameter_m / 2)
        ]
        return Drawing(board.columns * pitch, board.rows * pitch, tuple(strips), (half, half))


def _disc(radius):
    """Top, width and height of each strip, from the disc's centre."""
    height = 2 * radius / STRIPS
    for k in range(STRIPS):
        top = k * height - radius
        yield top, 2 * math.sqrt(radius**2 - (top + height / 2) ** 2), height
