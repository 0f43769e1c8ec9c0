"""Board files: what is written comes back to the last bit, whatever frame it was measured in, or is refused."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from opencsp_calib_opencv.board_kinds import CharucoKind, CheckerboardKind
from scipy.spatial.transform import Rotation

from opencsp_calib import Board, CharucoBoard, Checkerboard, InputError
from opencsp_calib.board_file import read_board_file, write_board_file
from opencsp_calib.errors import FileFormatError
from opencsp_calib.synthetic import bowed

BOARD = Checkerboard(5, 4, 0.03)


def parse(spec: str) -> Board:
    return (CharucoKind() if spec.startswith("charuco") else CheckerboardKind()).parse(spec)


def record(**changes: Any) -> dict[str, Any]:
    good = {"format": "opencsp-calib board", "version": 1, "board": BOARD.spec, "points_m": BOARD.points.tolist()}
    return {**good, **changes}


@settings(max_examples=30)
@given(columns=st.integers(3, 12), rows=st.integers(3, 12), side=st.floats(1e-3, 2.0), seed=st.integers(0, 99))
def test_a_shaped_board_comes_back_to_the_last_bit(
    columns: int, rows: int, side: float, seed: int, tmp_path: Path
) -> None:
    board = Checkerboard(columns, rows, side)
    board = board.with_points(board.points + np.random.default_rng(seed).normal(size=board.points.shape) * 0.02 * side)
    write_board_file(board, tmp_path / "board.json")
    assert read_board_file(tmp_path / "board.json", parse) == board


def test_a_charuco_board_comes_back(tmp_path: Path) -> None:
    board = bowed(CharucoBoard(5, 4, 0.03, 0.02, "DICT_4X4_50", inverted=True), 0.001)
    write_board_file(board, tmp_path / "board.json")
    assert read_board_file(tmp_path / "board.json", parse) == board


def test_points_of_a_measuring_machine_are_moved_as_a_rigid_body(tmp_path: Path) -> None:
    shaped = bowed(BOARD, 0.0008)
    turn = Rotation.from_rotvec([0.4, 2.0, -1.0])
    (tmp_path / "cmm.json").write_text(
        json.dumps(record(points_m=(turn.apply(np.array(shaped.points)) + np.array([1, -2, 0.5])).tolist()))
    )
    points = read_board_file(tmp_path / "cmm.json", parse).points
    np.testing.assert_allclose(points[:, :2], BOARD.points[:, :2], atol=2e-5)
    assert np.ptp(points[:, 2]) == pytest.approx(np.ptp(shaped.points[:, 2]), rel=1e-3)
    distances = np.linalg.norm(points[:, None] - points, axis=-1)
    np.testing.assert_allclose(distances, np.linalg.norm(shaped.points[:, None] - shaped.points, axis=-1), atol=1e-12)


def swapped(points: np.ndarray) -> list[list[float]]:
    return points.reshape(4, 5, 3).transpose(1, 0, 2).reshape(-1, 3).tolist()


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "not a board file"),
        ("{", "not a board file"),
        ("[" * 100_000, "not a board file"),
        ("[1, 2]", '"format" is not'),
        ('{"format": "other"}', '"format" is not'),
        (json.dumps(record(version=2)), "version 2"),
        (json.dumps(record(version="1")), "version '1'"),
        (json.dumps(record(board=7)), "must be text"),
        (json.dumps(record(points_m={"0": 1})), "must be text"),
        (json.dumps(record(board="checkerboard:5x4")), "size of a square is missing"),
        (json.dumps(record(points_m=BOARD.points[:-1].tolist())), "has 19 points, but checkerboard:5x4:30mm has 20"),
        (json.dumps(record(points_m=BOARD.points[:, :2].tolist())), r"shape \(20, 2\), expected \(20, 3\)"),
        (json.dumps(record(points_m=[["a", 0, 0]] * 20)), "not an array of numbers"),
        (json.dumps(record(points_m=[[0.0, 0.0], *BOARD.points[1:].tolist()])), "not an array of numbers"),
        (json.dumps(record(points_m=[[0.0, 0.0, float("nan")]] * 20)), "NaN is not a number"),
        (json.dumps(record(points_m=[[0.0, 0.0, float("inf")]] * 20)), "Infinity is not a number"),
        (json.dumps(record(points_m=[[0.0, 0.0, 10**400]] * 20)), "too large"),
        (json.dumps(record()).replace("0.03,", "1e999,"), "NaN or infinity"),
        (json.dumps(record(points_m=[[0.0, 0.0, 0.0]] * 20)), "0 times as far apart"),
        (json.dumps(record(points_m=(BOARD.points * 1000).tolist())), "1000 times as far apart"),
        (json.dumps(record(points_m=swapped(BOARD.points))), "in order of ids"),
    ],
)
def test_what_is_refused(text: str, said: str, tmp_path: Path) -> None:
    path = tmp_path / "board.json"
    path.write_text(text)
    with pytest.raises(FileFormatError, match=said) as caught:
        read_board_file(path, parse)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_is_no_text_or_too_large_or_not_there(tmp_path: Path) -> None:
    (tmp_path / "image.png").write_bytes(b"\x89PNG\xff\xfe")
    with pytest.raises(FileFormatError, match="not text"):
        read_board_file(tmp_path / "image.png", parse)
    with (tmp_path / "huge.json").open("wb") as file:
        file.truncate(2**40)
    with pytest.raises(FileFormatError, match="too large"):
        read_board_file(tmp_path / "huge.json", parse)
    with pytest.raises(InputError, match="No such file"):
        read_board_file(tmp_path / "nothing.json", parse)
    with pytest.raises(InputError, match="Is a directory"):
        read_board_file(tmp_path, parse)


def test_writing_replaces_and_says_where_it_cannot(tmp_path: Path) -> None:
    write_board_file(BOARD, tmp_path / "board.json")
    write_board_file(bowed(BOARD, 0.001), tmp_path / "board.json")
    assert read_board_file(tmp_path / "board.json", parse) == bowed(BOARD, 0.001)
    assert len(list(tmp_path.iterdir())) == 1
    with pytest.raises(InputError, match="does not exist"):
        write_board_file(BOARD, tmp_path / "nowhere" / "board.json")
