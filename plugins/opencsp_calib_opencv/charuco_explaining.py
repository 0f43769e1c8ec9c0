"""Why no ChArUco board was found: which one is there instead, and how to write it."""

from collections.abc import Iterator

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.board import CharucoBoard
from opencsp_calib.counted import counted
from opencsp_calib_opencv.board_kinds import DICTIONARIES
from opencsp_calib_opencv.layout import laid_out, read_board
from opencsp_calib_opencv.levels import Level
from opencsp_calib_opencv.markers import Markers, cells_of, dictionary_size, found_quads, read_markers

__all__ = ["why_no_charuco"]

FEWEST_MARKERS, CHANCE = 3, 3  # so many, and so many times what would be read by chance, are not there by chance
MOST_COLUMNS = 40
MARKER_PARTS = np.arange(0.2, 0.96, 0.05)  # of a square's side
SIZES = (4, 5, 6, 7)  # of all dictionaries, in cells
COLOURS = {True: "white on black", False: "black on white"}


def why_no_charuco(level: Level, board: CharucoBoard, quads: Floats, markers: Markers) -> str:
    """What to do about a photograph in which the markers found do not make up the board.

    Parameters
    ----------
    level : Level
    board : CharucoBoard
        The one looked for.
    quads : (n, 4, 2) px
        What may be markers.
    markers : Markers
        Those of them that may be the board's.
    """
    if _real(markers):
        return _arranged_otherwise(board, markers)
    other_quads = found_quads(level, inverted=not board.inverted)
    both = [(not board.inverted, other_quads), (board.inverted, quads)]
    for inverted, candidates in both:
        seen = candidates is not None and _seen_otherwise(level, board, candidates, inverted)
        if seen:
            return seen
    for inverted, candidates in reversed(both):
        found = None if candidates is None else _most_markers(level, candidates, inverted)
        if found:
            colours = "" if inverted == board.inverted else f", {COLOURS[inverted]}"
            return f"found {counted(found[1], 'marker')} of {found[0]}{colours}, none of {board.dictionary}"
    if len(markers.ids):
        return f"only {len(markers.ids)} of the board's markers could be read; go nearer, focus, or light it evenly"
    return f"no marker of {board.dictionary}, nor of any other dictionary, was found"


def _real(markers: Markers) -> bool:
    return len(markers.ids) >= FEWEST_MARKERS + CHANCE * markers.by_chance


def _seen_otherwise(level: Level, board: CharucoBoard, quads: Floats, inverted: bool) -> str:
    """What is said of the board's own markers in the other colours, or in a mirror; empty where there are none."""
    cells = cells_of(level, quads, dictionary_size(board.dictionary), inverted=inverted)
    mirrored = [mirror for mirror in (False, True) if _real(read_board(cells, board, mirrored=mirror))]
    if not mirrored:
        return ""
    reasons = []
    if inverted != board.inverted:
        advice = "write :inverted at its end" if inverted else "leave out :inverted"
        reasons.append(f"the board is printed {COLOURS[inverted]}: {advice}")
    if mirrored[0]:
        reasons.append("the image is mirrored: its markers can be read in a mirror only; switch that off in the camera")
    return "; ".join(reasons)


def _most_markers(level: Level, quads: Floats, inverted: bool) -> tuple[str, int] | None:
    """The dictionary that most of the quadrilaterals are markers of, and how many; None where hardly any are."""
    cells = {size: cells_of(level, quads, size, inverted=inverted) for size in SIZES}
    best, best_score = None, 0.0
    for name, count in DICTIONARIES.items():
        markers = read_markers(cells[dictionary_size(name)], name, count)
        score = len(markers.ids) - CHANCE * markers.by_chance  # so the smallest of those that begin alike wins
        if _real(markers) and score > best_score:
            best, best_score = (name, len(markers.ids)), score
    return best


def _arranged_otherwise(board: CharucoBoard, markers: Markers) -> str:
    seen = f"{counted(len(markers.ids), 'of its markers was', 'of its markers were')} found, but "
    if len(markers.ids) - len(np.unique(markers.ids)) >= FEWEST_MARKERS:
        return f"{seen}some of them twice: two such boards are in view; cover one, or leave out the image"
    for other, advice in _variants(board):
        if laid_out(markers, other).fits:
            return f"{seen}{advice}"
    part = _marker_part(board, markers)
    if part is not None:
        asked = board.marker_m / board.spacing_m
        return f"{seen}they look about {part:.2f} of a square wide, not {asked:.2f}: measure one, and write its side"
    return f"{seen}not side by side as on a board of {board.columns}x{board.rows} squares"


def _variants(board: CharucoBoard) -> Iterator[tuple[CharucoBoard, str]]:
    columns, rows, legacy = board.columns, board.rows, board.legacy
    when, advice = ("from 4.6 on", "leave out :legacy") if legacy else ("before 4.6", "write :legacy at its end")
    yield _variant(board, columns, rows, not legacy), f"in the layout of OpenCV {when}: {advice}"
    if columns != rows:
        exchanged = f"arranged as on a board of {rows}x{columns} squares: columns and rows look exchanged"
        yield _variant(board, rows, columns, legacy), exchanged
    for number in range(3, MOST_COLUMNS + 1):
        yield _variant(board, number, rows, legacy), f"arranged in {number} columns of squares, not {columns}"


def _marker_part(board: CharucoBoard, markers: Markers) -> float | None:
    """The part of a square's side that the markers seem to take; None where the board is no such one, whatever it is.

    Markers foretell a corner between them alike for all parts near the true one: it is in the middle of those.
    """
    fitting = []
    for part in MARKER_PARTS:
        other = _variant(board, board.columns, board.rows, board.legacy, part * board.spacing_m)
        if laid_out(markers, other).fits:
            fitting.append(part)
    return float(np.mean(fitting)) if fitting else None


def _variant(board: CharucoBoard, columns: int, rows: int, legacy: bool, marker_m: float | None = None) -> CharucoBoard:
    marker_m = board.marker_m if marker_m is None else marker_m
    return CharucoBoard(
        columns, rows, board.spacing_m, marker_m, board.dictionary, inverted=board.inverted, legacy=legacy
    )
