"""Board files: which board it is, and where its corners truly are, as measured or as solved.

JSON in UTF-8::

    {
      "format": "opencsp-calib board",
      "version": 1,
      "board": "checkerboard:18x23:50mm",
      "points_m": [[0.0, 0.0, 0.0], [0.05001, 0.0, 0.0002], ...]
    }

``points_m`` has a point for every corner, in order of ids: row by row, columns fastest. They may be in the frame of
whatever machine measured them; further keys are ignored.
"""

import json
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from opencsp_calib.arrays import Points, checked
from opencsp_calib.atomic import replacing
from opencsp_calib.board import Board
from opencsp_calib.errors import BoardSpecError, FileFormatError, InputError

__all__ = ["read_board_file", "write_board_file"]

FORMAT = "opencsp-calib board"
VERSION = 1
MAX_BYTES = 32 * 2**20  # several times what the largest board takes
ODD = 0.25  # of a square: corners farther from where they should be are not those of this board


def read_board_file(path: str | os.PathLike[str], parse_spec: Callable[[str], Board]) -> Board:
    """The board of a board file, with its corners where the file has them.

    Parameters
    ----------
    path : path-like
    parse_spec : callable
        Makes the nominal board of a one-line description; `Registry.board` is one.

    Returns
    -------
    Board
        Its points are the file's to the last bit where they are in the board's own frame (x along the columns, y
        along the rows, origin at id 0); those of another frame are moved there, as a rigid body.

    Raises
    ------
    InputError
        If there is no such file.
    FileFormatError
        If it is not a board file, is damaged, has another number of points than the board has corners, or points
        that are not where the corners of such a board can be.
    """
    path = Path(path)
    record = _record(path)
    spec, points = record.get("board"), record.get("points_m")
    if not isinstance(spec, str) or not isinstance(points, list):
        raise FileFormatError(f'{path} is damaged: "board" must be text and "points_m" a list of points')
    try:
        board = parse_spec(spec)
    except BoardSpecError as error:
        raise FileFormatError(f"{path}: {error}") from None
    if len(points) != len(board.points):
        raise FileFormatError(f"{path} has {len(points)} points, but {spec} has {len(board.points)} corners")
    try:
        measured = checked(points, "points_m", (len(board.points), 3))
    except (InputError, OverflowError) as error:
        raise FileFormatError(f"{path}: {error}") from None
    return board.with_points(_in_board_frame(board, measured, path))


def write_board_file(board: Board, path: str | os.PathLike[str]) -> None:
    """Write a board with its corners where they are; reading it gives the same numbers to the last bit.

    Raises
    ------
    InputError
        If the file cannot be written; what was there before stays.
    """
    points = ",\n".join(f"    {json.dumps(point)}" for point in board.points.tolist())
    head = f'  "format": "{FORMAT}",\n  "version": {VERSION},\n  "board": {json.dumps(board.spec)},\n'
    with replacing(path) as temporary:
        temporary.write_text(f'{{\n{head}  "points_m": [\n{points}\n  ]\n}}\n', encoding="utf-8")


def _record(path: Path) -> dict[str, Any]:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise FileFormatError(f"{path} is too large for a board file")
        text = path.read_bytes().decode()
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise FileFormatError(f"{path} is not a board file: it is not text") from None
    try:
        record = json.loads(text, parse_constant=_refuse)
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"{path} is not a board file, or is damaged: {error}") from None
    if not isinstance(record, dict) or record.get("format") != FORMAT:
        raise FileFormatError(f'{path} is not a board file: its "format" is not "{FORMAT}"')
    if record.get("version") != VERSION:
        raise FileFormatError(f"{path} is of version {record.get('version')!r}; this program reads {VERSION}")
    return record


def _refuse(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is not a number of metres")


def _in_board_frame(board: Board, measured: Points, path: Path) -> Points:
    """The measured points, moved as a rigid body if they are in another frame than the board's."""
    if _farthest(board, measured) < ODD:
        return measured
    nominal_centre, centre = board.nominal_points.mean(axis=0), measured.mean(axis=0)
    spread = np.linalg.norm(measured - centre) / np.linalg.norm(board.nominal_points - nominal_centre)
    if not 0.8 < spread < 1.25:
        raise FileFormatError(
            f"{path}: the points are {spread:.4g} times as far apart as the corners of {board.spec}; "
            "they must be in metres, and the squares of the size given"
        )
    from scipy.spatial.transform import Rotation

    turn, _ = Rotation.align_vectors(board.nominal_points - nominal_centre, measured - centre)
    moved = np.asarray(turn.apply(measured - centre) + nominal_centre, dtype=np.float64)
    if _farthest(board, moved) >= ODD:
        raise FileFormatError(
            f"{path}: the points are not where the corners of {board.spec} can be; "
            "they must be in order of ids, row by row"
        )
    return moved


def _farthest(board: Board, points: Points) -> float:
    """The largest distance of a corner from its nominal place, in squares."""
    return float(np.linalg.norm(points - board.nominal_points, axis=1).max() / board.spacing_m)
