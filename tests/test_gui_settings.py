"""What is typed into the window's fields: what is wrong is said at once, by the field's own name."""

from dataclasses import replace
from pathlib import Path

import pytest

from opencsp_calib.board import Checkerboard
from opencsp_calib.board_file import write_board_file
from opencsp_calib.errors import InputError
from opencsp_calib.gui.board_text import board_text
from opencsp_calib.gui.settings import FILE, Settings

EMPTY = Settings()
WHOLE = replace(EMPTY, grid_x="18", grid_y=" 23 ", square_mm="50")


@pytest.mark.parametrize(
    ("typed", "field"),
    [
        ({"grid_x": "nine"}, "Grid points x"),
        ({"grid_y": "²"}, "Grid points y"),
        ({"grid_y": "١٨"}, "Grid points y"),
        ({"grid_x": "9" * 30}, "Grid points x"),
        ({"square_mm": "50,5"}, "Square size"),
        ({"square_mm": "inf"}, "Square size"),
        ({"board_kind": "charuco", "grid_x": "-1"}, "Squares x"),
        ({"board_kind": "charuco", "marker_mm": "0"}, "Marker size"),
        ({"pixel_aspect": "wide"}, "pixel aspect"),
        ({"select": "2"}, "Keep the N most telling views"),
        ({"select": "many"}, "Keep the N most telling views"),
        ({"drop_worst": "-1"}, "Leave out the N worst views"),
        ({"max_rms": "nan"}, "Leave out views above rms"),
        ({"pixel_pitch_um": "abc"}, "Pixel size"),
        ({"pixel_pitch_um": "-4"}, "Pixel size"),
        ({"notes": "focus"}, "KEY=VALUE"),
    ],
)
@pytest.mark.parametrize("rest", [EMPTY, WHOLE], ids=["first field typed", "all others typed"])
def test_a_wrong_field_is_named_whatever_is_empty_still(rest: Settings, typed: dict[str, str], field: str) -> None:
    with pytest.raises(InputError, match=field):
        replace(rest, **typed).check_typed()


def test_fields_that_are_empty_still_are_not_wrong() -> None:
    EMPTY.check_typed()
    replace(EMPTY, grid_x="18").check_typed()
    with pytest.raises(InputError, match="Grid points y"):
        replace(EMPTY, grid_x="18").board()


def test_a_board_that_is_none_is_said_once_all_of_it_is_typed() -> None:
    replace(EMPTY, grid_x="2", grid_y="5").check_typed()
    with pytest.raises(InputError, match="at least 3 inner corners"):
        replace(WHOLE, grid_x="2").check_typed()


def test_a_board_in_a_file_is_read_again_when_it_has_changed(tmp_path: Path) -> None:
    board, (folder, file) = Checkerboard(9, 6, 0.03), (tmp_path / "work", tmp_path / "work" / "board.json")
    folder.mkdir()
    chosen = replace(EMPTY, board_kind=FILE, board_spec="board.json")
    for spec, message in (
        ("", "name a board file"),
        ("a.png", "name a board file"),
        ("board.json", "does not exist"),
        ("../x.json", "outside"),
    ):
        with pytest.raises(InputError, match=message):
            board_text(replace(chosen, board_spec=spec), folder)
    write_board_file(board, file)
    assert board_text(chosen, folder) == str(file)
    file.write_text("{}")
    with pytest.raises(InputError, match="not a board file"):
        board_text(chosen, folder)


def test_what_is_right_is_taken_as_on_the_command_line() -> None:
    typed = replace(WHOLE, select="30", drop_worst="2", max_rms="0.3", pixel_pitch_um="3.45", notes="focus=2 m\n")
    typed.check_typed()
    assert typed.board().spec == "checkerboard:18x23:50mm"
    assert typed.leaving_out == {"select": 30, "drop_worst": 2, "max_rms": 0.3}
    assert typed.record == {"focus": "2 m", "pixel_pitch_um": "3.45"}
