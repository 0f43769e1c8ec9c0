"""Kinds of calibration target that OpenCV knows: how they are described in one line, and how they are printed."""

import re
from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any

from opencsp_calib.board import Board, CharucoBoard, Checkerboard, parse_length
from opencsp_calib.drawing import Drawing, Rectangle, checkerboard_drawing
from opencsp_calib.errors import BoardSpecError, MissingDependencyError
from opencsp_calib_opencv.available import missing_opencv

__all__ = ["DICTIONARIES", "CharucoKind", "CheckerboardKind", "opencv_board"]

DICTIONARIES: Mapping[str, int] = MappingProxyType(
    {
        **{f"DICT_{n}X{n}_{count}": count for n in (4, 5, 6, 7) for count in (50, 100, 250, 1000)},
        "DICT_ARUCO_ORIGINAL": 1024,
        "DICT_ARUCO_MIP_36h12": 250,
        "DICT_APRILTAG_16h5": 30,
        "DICT_APRILTAG_25h9": 35,
        "DICT_APRILTAG_36h10": 2320,
        "DICT_APRILTAG_36h11": 587,
    }
)
"""OpenCV's predefined dictionaries of markers, and how many markers each has; the numbers never changed."""


class CheckerboardKind:
    """Plain checkerboards."""

    name = "checkerboard"
    grammar = "checkerboard:COLUMNSxROWS:SIZE"
    example = "checkerboard:18x23:50mm (18 columns and 23 rows of inner corners, squares of 50 mm)"

    def missing(self) -> str | None:
        """See `Provided.missing`: nothing ever is."""
        return None

    def parse(self, spec: str) -> Board:
        """The board of a description; raises BoardSpecError, whose message shows how to write it."""
        grid, square, *rest = _fields(spec, 2)
        try:
            columns, rows = _columns_rows(grid, "the number of inner corners")
            side = _length(square, "the size of a square")
            if rest:
                raise BoardSpecError(f"{rest[0]!r} is too much")
            return Checkerboard(columns, rows, side)
        except BoardSpecError as error:
            raise _explained(spec, error, self) from None

    def draw(self, board: Board) -> Drawing:
        """Its dark squares; raises BoardSpecError if it is no checkerboard."""
        if not isinstance(board, Checkerboard):
            raise BoardSpecError(f"a {board.kind} cannot be drawn as a plain checkerboard")
        return checkerboard_drawing(board)


class CharucoKind:
    """ChArUco boards: a checkerboard with a marker in every white square, so that parts of it can be told apart."""

    name = "charuco"
    grammar = "charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY[:inverted][:legacy]"
    example = "charuco:11x8:30mm:22mm:DICT_4X4_50 (11 columns and 8 rows of squares of 30 mm, markers of 22 mm)"

    def missing(self) -> str | None:
        """See `Provided.missing`: only drawing needs OpenCV."""
        return missing_opencv()

    def parse(self, spec: str) -> Board:
        """The board of a description; raises BoardSpecError, whose message shows how to write it."""
        grid, square, marker, dictionary, *flags = _fields(spec, 4)
        try:
            columns, rows = _columns_rows(grid, "the number of squares")
            sizes = _length(square, "the size of a square"), _length(marker, "the size of a marker")
            name = _dictionary(dictionary, markers=columns * rows // 2)
            wrong = [flag for flag in flags if flag not in ("inverted", "legacy")]
            if wrong:
                raise BoardSpecError(f"{wrong[0]!r} is not known there; only inverted and legacy are")
            return CharucoBoard(columns, rows, *sizes, name, "inverted" in flags, "legacy" in flags)
        except BoardSpecError as error:
            raise _explained(spec, error, self) from None

    def draw(self, board: Board) -> Drawing:
        """Squares and markers where OpenCV puts them; white on black where the board is inverted.

        Raises
        ------
        BoardSpecError
            If it is not a ChArUco board.
        MissingDependencyError
            If OpenCV is not installed.
        """
        if not isinstance(board, CharucoBoard):
            raise BoardSpecError(f"a {board.kind} cannot be drawn as a ChArUco board")
        made = opencv_board(board)
        side, white = board.spacing_m, board.inverted
        inset = (side - board.marker_m) / 2.0
        places = [_square_at(corners[0], inset, side) for corners in made.getObjPoints()]
        cells = [(i, j) for j in range(board.rows) for i in range(board.columns)]
        rectangles = [Rectangle(i * side, j * side, side, side, white) for i, j in cells if (i, j) not in places]
        for number, (i, j) in zip(made.getIds().ravel(), places, strict=True):
            corner = (i * side + inset, j * side + inset)
            rectangles += _marker(made.getDictionary(), int(number), corner, board.marker_m, white)
        width, height = board.columns * side, board.rows * side
        return Drawing(width, height, tuple(rectangles), (side, side), dark=board.inverted)


def opencv_board(board: CharucoBoard) -> Any:
    """The same as OpenCV's own ``cv2.aruco.CharucoBoard``; raises MissingDependencyError where there is no OpenCV."""
    missing = missing_opencv()
    if missing:
        raise MissingDependencyError(f"a ChArUco board cannot be made here: {missing}")
    import cv2

    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary))
    made = cv2.aruco.CharucoBoard((board.columns, board.rows), board.spacing_m, board.marker_m, dictionary)
    made.setLegacyPattern(board.legacy)
    return made


def _square_at(corner: Any, inset: float, side: float) -> tuple[int, int]:
    """Column and row of the square whose marker has this upper left corner."""
    return round((float(corner[0]) - inset) / side), round((float(corner[1]) - inset) / side)


def _marker(dictionary: Any, number: int, corner: tuple[float, float], side: float, white: bool) -> Iterator[Rectangle]:
    """A black square with white modules; the other way round for a board printed in white."""
    modules = dictionary.markerSize + 2
    bits = dictionary.generateImageMarker(number, modules, borderBits=1)
    module = side / modules
    x, y = corner
    yield Rectangle(x, y, side, side, white)
    for j, i in zip(*bits.nonzero(), strict=True):
        yield Rectangle(x + int(i) * module, y + int(j) * module, module, module, not white)


def _fields(spec: str, wanted: int) -> list[str]:
    """What stands between the colons, without the name; empty where something wanted is missing."""
    fields = [field.strip() for field in spec.split(":")[1:]]
    return fields + [""] * (wanted - len(fields))


def _columns_rows(text: str, what: str) -> tuple[int, int]:
    if not text:
        raise BoardSpecError(f"{what} is missing")
    match = re.fullmatch(r"([0-9]{1,6})\s*[xX×]\s*([0-9]{1,6})", text)
    if not match:
        raise BoardSpecError(f"{what}, {text!r}, is not two whole numbers with an x between them")
    columns, rows = int(match[1]), int(match[2])
    if not (columns and rows):
        raise BoardSpecError(f"{what}, {text!r}, must not be zero")
    return columns, rows


def _length(text: str, what: str) -> float:
    if not text:
        raise BoardSpecError(f"{what} is missing")
    try:
        return parse_length(text)
    except BoardSpecError as error:
        raise BoardSpecError(f"{what}: {error}") from None


def _dictionary(name: str, markers: int) -> str:
    """OpenCV's spelling of a dictionary that has that many markers."""
    if not name:
        raise BoardSpecError("the dictionary of the markers is missing")
    found = {known.lower(): known for known in DICTIONARIES}.get(name.lower())
    if found is None:
        raise BoardSpecError(f"{name!r} is not a dictionary of OpenCV's; there are {', '.join(DICTIONARIES)}")
    if DICTIONARIES[found] < markers:
        raise BoardSpecError(f"such a board has {markers} markers, but {found} has only {DICTIONARIES[found]}")
    return found


def _explained(spec: str, error: BoardSpecError, kind: CheckerboardKind | CharucoKind) -> BoardSpecError:
    return BoardSpecError(f"{spec!r}: {error}. Write {kind.grammar}, like {kind.example}")
