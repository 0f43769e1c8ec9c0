"""What a person types and chooses before calibrating, kept as typed, so that half a number is not lost."""

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from opencsp_calib.board import Board
from opencsp_calib.errors import BoardSpecError, InputError
from opencsp_calib.options import PRESETS
from opencsp_calib.pipeline import DEFAULT_MODEL, DEFAULT_SOLVER
from opencsp_calib.registry import installed
from opencsp_calib.summary import PIXEL_PITCH
from opencsp_calib.typed import aspect_from, notes_from

__all__ = ["BY_FIELDS", "COUNTED", "Settings"]

COUNTED = {"checkerboard": ("Grid points x", "Grid points y"), "charuco": ("Squares x", "Squares y")}
"""How the fields of a board's columns and rows are called, which count what its kind counts."""

BY_FIELDS = tuple(COUNTED)
"""Kinds of board that have fields of their own; any other is described in one line."""


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
        In one line, of any other kind.
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
        if self.board_kind in BY_FIELDS:
            for text, field in zip((self.grid_x, self.grid_y), COUNTED[self.board_kind], strict=True):
                if not text.strip().isdecimal():
                    raise BoardSpecError(f"{field} must be a whole number, such as 18, not {text!r}")
            sizes = [(self.square_mm, "Square size")]
            sizes += [(self.marker_mm, "Marker size")] if self.board_kind == "charuco" else []
            for text, field in sizes:
                _number(text, field)
        return installed().board(self.spec)

    @property
    def is_complete(self) -> bool:
        """Whether the fields describe a board."""
        try:
            self.board()
        except InputError:
            return False
        return True

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
        asked = (("select", int), ("drop_worst", int), ("max_rms", float))
        try:
            return {key: kind(getattr(self, key)) for key, kind in asked if getattr(self, key).strip()}
        except ValueError as error:
            raise InputError(f"which views are left out is told by numbers: {error}") from None

    @property
    def record(self) -> dict[str, str]:
        """What is to be kept with the camera: the notes, one ``key = value`` a line, and the size of its pixels.

        Raises
        ------
        InputError
            If a line is none.
        """
        notes = notes_from(line for line in self.notes.splitlines() if line.strip())
        return notes | ({PIXEL_PITCH: f"{float(self.pixel_pitch_um):g}"} if self.pixel_pitch_um.strip() else {})

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


def _number(text: str, field: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not value > 0:
        raise BoardSpecError(f"{field} must be a length in mm, such as 50, not {text!r}")
    return value
