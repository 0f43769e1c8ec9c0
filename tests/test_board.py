"""Boards: numbering, symmetry against the pattern itself, and lengths as people write them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opencsp_calib import CharucoBoard, Checkerboard
from opencsp_calib.board import RecordedBoard, format_length, parse_length
from opencsp_calib.errors import BoardSpecError, InputError


def test_ids_run_along_the_columns() -> None:
    board = Checkerboard(4, 3, 0.05)
    assert board.points.shape == (12, 3)
    np.testing.assert_allclose(board.points[1 * 4 + 2], [0.10, 0.05, 0.0])


@given(columns=st.integers(3, 12), rows=st.integers(3, 12))
def test_symmetric_is_what_the_pattern_looks_like_upside_down(columns: int, rows: int) -> None:
    y, x = np.mgrid[: rows + 1, : columns + 1]
    dark = (x + y) % 2 == 0
    assert Checkerboard(columns, rows, 0.01).symmetric == np.array_equal(dark, dark[::-1, ::-1])


def test_charuco_counts_squares_and_has_inner_corners() -> None:
    board = CharucoBoard(4, 5, 0.054, 0.0405, "DICT_4X4_50", inverted=True)
    assert board.grid == (3, 4)
    assert board.points.shape == (12, 3)
    assert board.spec == "charuco:4x5:54mm:40.5mm:DICT_4X4_50:inverted"


@pytest.mark.parametrize(
    "make",
    [
        lambda: Checkerboard(2, 9, 0.05),
        lambda: Checkerboard(5, 5, 0.0),
        lambda: Checkerboard(5, 5, float("nan")),
        lambda: Checkerboard(5000, 5000, 0.01),
        lambda: CharucoBoard(4, 5, 0.03, 0.05, "DICT_4X4_50"),
        lambda: CharucoBoard(2, 5, 0.05, 0.03, "DICT_4X4_50"),
    ],
)
def test_impossible_boards_are_refused(make: object) -> None:
    with pytest.raises(BoardSpecError):
        make()  # type: ignore[operator]


def test_points_are_checked_and_kept() -> None:
    board = Checkerboard(4, 3, 0.05)
    moved = board.with_points(board.points + 1e-3)
    np.testing.assert_allclose(moved.points - moved.nominal_points, 1e-3)
    assert moved.spec == board.spec
    assert moved != board
    with pytest.raises(InputError, match=r"\(11, 3\), expected \(12, 3\)"):
        board.with_points(board.points[1:])
    assert RecordedBoard(4, 3, 0.05, "dots:4x3").kind == "dots"


@pytest.mark.parametrize(
    ("text", "metres"), [("50mm", 0.05), ("5 cm", 0.05), ("0.05m", 0.05), ("2in", 0.0508), (".5mm", 0.0005)]
)
def test_lengths(text: str, metres: float) -> None:
    assert parse_length(text) == pytest.approx(metres, rel=1e-15)


@pytest.mark.parametrize("text", ["50", "50px", "-5mm", "mm", "", "1e9m", "0mm", "5 0mm", "nan mm"])
def test_a_length_without_a_known_unit_is_refused(text: str) -> None:
    with pytest.raises(BoardSpecError, match="mm"):
        parse_length(text)


@given(st.floats(1e-6, 1e3))
def test_a_written_length_reads_back_the_same(metres: float) -> None:
    assert parse_length(format_length(metres)) == metres
