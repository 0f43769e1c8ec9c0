"""What a person types and chooses before calibrating, kept as typed, so that half a number is not lost."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from opencsp_calib.board import Board
from opencsp_calib.errors import BoardSpecError, InputError
from opencsp_calib.options import PRESETS
from opencsp_calib.pipeline import DEFAULT_MODEL, DEFAULT_SOLVER
from opencsp_calib.registry import installed
from opencsp_calib.summary import PIXEL_PITCH
from opencsp_calib.typed import aspect_from, notes_from

__all__ = ["BY_FIELDS", "COUNTED", "FILE", "Settings"]

COUNTED = {"checkerboard": ("Grid points x", "Grid points y"), "charuco": ("Squares x", "Squares y")}
"""How the fields of a board's columns and rows are called, which count what its kind counts."""

BY_FIELDS = tuple(COUNTED)
"""Kinds of board that have fields of their own; any other is described in one line."""


FILE = "file"
"""The kind of a board that is in a file, with its corners as measured or as solved."""


@dataclass(frozen=True)
class Settings:
    """All fields of the page. An empty text leaves the choice to the pipeline, as an option not given does.

    Parameters
    ----------
    camera_name : str
    board_kind : str
    grid_x, grid_y, square_mm : str
        As the kind counts: grid points of a checkerboard, squares of ChArUco.
    marker_mm, dictionary : str
    inverted, legacy : bool
        These four of ChArUco.
    board_spec : str
        In one line, of any other kind; where the file is, of `FILE`.
    model, solver, board_shape, pixel_aspect, weights, robust, guess, detector, refine, preset, notes
        As the options of ``calibrate``.
    select, drop_worst, max_rms : str
        As those too: which views to leave out for what they are like.
    """

    camera_name: str = ""
    board_kind: str = "checkerboard"
    grid_x: str = ""
    grid_y: str = ""
    square_mm: str = ""
    marker_mm: str = ""
    dictionary: str = "DICT_4X4_50"
    inverted: bool = False
    legacy: bool = False
    board_spec: str = ""
    model: str = DEFAULT_MODEL
    solver: str = DEFAULT_SOLVER
    board_shape: str = "auto"
    pixel_aspect: str = ""
    weights: str = ""
    robust: str = ""
    guess: str = ""
    detector: str = ""
    refine: str = ""
    preset: str = ""
    select: str = ""
    drop_worst: str = ""
    max_rms: str = ""
    pixel_pitch_um: str = ""
    notes: str = ""

    @property
    def spec(self) -> str:
        """The board in one line, as on the command line."""
        if self.board_kind not in BY_FIELDS:
            return self.board_spec.strip()
        spec = f"{self.board_kind}:{self.grid_x.strip()}x{self.grid_y.strip()}:{self.square_mm.strip()}mm"
        if self.board_kind == "charuco":
            spec += f":{self.marker_mm.strip()}mm:{self.dictionary}" + ":inverted" * self.inverted
            spec += ":legacy" * self.legacy
        return spec

    def board(self) -> Board:
        """The board that the fields describe.

        Raises
        ------
        BoardSpecError
            If they do not; the message says which field is wrong.
        """
        for text, field, check in self._board_fields():
            check(text.strip(), field)
        return installed().board(self.spec)

    def check_typed(self) -> None:
        """See that what has been typed so far can be understood; fields may be empty still.

        Raises
        ------
        InputError
            If it cannot; the message says which field is wrong.
        """
        typed = [(text.strip(), field, check) for text, field, check in self._board_fields()]
        for text, field, check in typed:
            if text:
                check(text, field)
        if all(text for text, _, _ in typed) and self.spec and self.board_kind != FILE:
            self.board()
        _ = self.solving, self.leaving_out, self.record  # each refuses what it cannot understand

    def _board_fields(self) -> list[tuple[str, str, Callable[[str, str], None]]]:
        """What is typed into each field of the board, the field's name, and what it must be."""
        if self.board_kind not in BY_FIELDS:
            return []
        columns, rows = COUNTED[self.board_kind]
        markers = [(self.marker_mm, "Marker size", _check_length)] if self.board_kind == "charuco" else []
        return [
            (self.grid_x, columns, _check_count),
            (self.grid_y, rows, _check_count),
            (self.square_mm, "Square size", _check_length),
            *markers,
        ]

    @property
    def finding(self) -> dict[str, Any]:
        """The options of `pipeline.detect` that were chosen."""
        preset = PRESETS.get(self.preset, {})
        asked = {"detector": self.detector, "refine": self.refine}
        return {key: preset.get(key, value) for key, value in asked.items() if preset.get(key, value)}

    @property
    def solving(self) -> dict[str, Any]:
        """The options of `pipeline.solve` that were chosen, but for the guess, which is a file.

        Raises
        ------
        InputError
            If one cannot be understood.
        """
        if self.preset:
            return {key: value for key, value in PRESETS[self.preset].items() if key not in ("detector", "refine")}
        asked: dict[str, Any] = {"model": self.model, "solver": self.solver, "board_shape": self.board_shape}
        if self.pixel_aspect.strip():
            asked["pixel_aspect"] = aspect_from(self.pixel_aspect.strip())
        if self.weights:
            asked["weights"] = self.weights
        if self.robust:
            asked["robust"] = self.robust == "yes"
        return asked

    @property
    def leaving_out(self) -> dict[str, Any]:
        """Which views to leave out for what they are like.

        Raises
        ------
        InputError
            If it is not told by numbers.
        """
        asked: tuple[tuple[str, Callable[[str], float], float, str], ...] = (
            ("select", int, 3, '"Keep the N most telling views" takes a whole number from 3 on'),
            ("drop_worst", int, 0, '"Leave out the N worst views" takes a whole number'),
            ("max_rms", float, 0, '"Leave out views above rms" takes a number of pixels'),
        )
        typed = [(key, getattr(self, key).strip(), kind, least, rule) for key, kind, least, rule in asked]
        return {key: _number(text, kind, least, math.inf, rule) for key, text, kind, least, rule in typed if text}

    @property
    def record(self) -> dict[str, str]:
        """What is to be kept with the camera: the notes, one ``key = value`` a line, and the size of its pixels.

        Raises
        ------
        InputError
            If a line is none, or the size is no number.
        """
        notes = notes_from(line for line in self.notes.splitlines() if line.strip())
        if not self.pixel_pitch_um.strip():
            return notes
        size = _number(self.pixel_pitch_um, float, 0.01, 1000, "Pixel size must be from 0.01 to 1000 µm, such as 3.45")
        return notes | {PIXEL_PITCH: f"{size:g}"}

    def as_json(self) -> dict[str, Any]:
        """For the session file."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_json(cls, entry: Mapping[str, Any]) -> "Settings":
        """What a session file says, as far as it is of the right kind; the rest is as at the start."""
        start = cls()
        given: dict[str, Any] = {
            key: entry[key] for key in KNOWN & entry.keys() if type(entry[key]) is type(getattr(start, key))
        }
        return replace(start, **given)


KNOWN = frozenset(field.name for field in fields(Settings))


def _check_count(text: str, field: str) -> None:
    if not (text.isascii() and text.isdecimal() and len(text) < 6):
        raise BoardSpecError(f"{field} must be a whole number, such as 18, not {text!r}")


def _check_length(text: str, field: str) -> None:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not (math.isfinite(value) and value > 0):
        raise BoardSpecError(f"{field} must be a length in mm, such as 50, not {text!r}")


def _number(text: str, kind: Callable[[str], float], least: float, most: float, rule: str) -> float:
    """A number in a range, as `kind` reads it; else an InputError with the rule."""
    try:
        value = kind(text)
    except ValueError:
        value = math.nan
    if not least <= value <= most:
        raise InputError(f"{rule}, not {text.strip()!r}")
    return value
