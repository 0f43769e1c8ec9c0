"""Board kinds that lie, one lie each."""

from dataclasses import replace

import pytest
from lies import caught
from opencsp_calib_opencv.board_kinds import CheckerboardKind

from opencsp_calib.board import Checkerboard
from opencsp_calib.errors import BoardSpecError


class RowsFirst(CheckerboardKind):
    def parse(self, spec):
        board = super().parse(spec)
        return Checkerboard(board.rows, board.columns, board.spacing_m)


class Upwards(CheckerboardKind):
    def parse(self, spec):
        board = super().parse(spec)
        return board.with_points(board.points * [1.0, -1.0, 1.0])


class Lenient(CheckerboardKind):
    def parse(self, spec):
        return super().parse(":".join(spec.split(":")[:3]))


class ParsesRudely(CheckerboardKind):
    def parse(self, spec):
        columns, rows = map(int, spec.split(":")[1].split("x"))
        return super().parse(f"checkerboard:{columns}x{rows}:{spec.split(':')[2]}")


class Mute(CheckerboardKind):
    def parse(self, spec):
        try:
            return super().parse(spec)
        except BoardSpecError:
            raise BoardSpecError("no") from None


class DrawsElsewhere(CheckerboardKind):
    def draw(self, board):
        drawing = super().draw(board)
        return replace(drawing, origin_m=(1.1 * board.spacing_m, board.spacing_m))


class LightFirst(CheckerboardKind):
    def draw(self, board):
        return replace(super().draw(board), origin_m=(2 * board.spacing_m, board.spacing_m))


class OffThePage(CheckerboardKind):
    def draw(self, board):
        drawing = super().draw(board)
        return replace(drawing, width_m=0.9 * drawing.width_m)


BOARD_LIES = [
    (RowsFirst, "parses_its_own_descriptions"),
    (Upwards, "numbers_corners_row_by_row"),
    (Lenient, "refuses_what_it_cannot_understand"),
    (ParsesRudely, "refuses_what_it_cannot_understand"),
    (Mute, "refuses_what_it_cannot_understand"),
    (DrawsElsewhere, "draws_its_corners_where_they_are"),
    (LightFirst, "draws_its_corners_where_they_are"),
    (OffThePage, "draws_its_corners_where_they_are"),
]


@pytest.mark.parametrize(("liar", "check"), BOARD_LIES, ids=lambda value: getattr(value, "__name__", value))
def test_a_lying_board_kind_is_caught(liar, check):
    assert caught(liar(), check)


def test_a_board_kind_of_a_third_party_needs_its_own_descriptions():
    class Rings(CheckerboardKind):
        name, grammar = "rings", "rings:COLUMNSxROWS:SIZE"

    assert "specs=" in caught(Rings(), "parses_its_own_descriptions")
