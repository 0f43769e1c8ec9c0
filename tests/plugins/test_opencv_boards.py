"""The board kinds: what one types, what is refused and how, and that OpenCV draws the same."""

import subprocess
import sys

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from opencsp_calib_opencv.board_kinds import DICTIONARIES, CharucoKind, CheckerboardKind

from opencsp_calib import CharucoBoard, Checkerboard
from opencsp_calib.errors import BoardSpecError
from opencsp_calib.interfaces import BoardKind, Drawing

lengths = st.floats(1e-4, 10.0)


def rastered(drawing: Drawing, pixel_m: float) -> np.ndarray:
    """Black 0 and white 255, of a drawing whose edges all lie between pixels."""
    size = round(drawing.height_m / pixel_m), round(drawing.width_m / pixel_m)
    page = np.full(size, 0 if drawing.dark else 255, dtype=np.uint8)
    for r in drawing.rectangles:
        left, top = r.x_m / pixel_m, r.y_m / pixel_m
        right, bottom = left + r.width_m / pixel_m, top + r.height_m / pixel_m
        x0, y0, x1, y1 = (round(edge) for edge in (left, top, right, bottom))
        assert np.allclose([left, top, right, bottom], [x0, y0, x1, y1], atol=1e-6)
        page[y0:y1, x0:x1] = 255 if r.white else 0
    return page


def test_they_keep_the_contract() -> None:
    for kind in (CheckerboardKind(), CharucoKind()):
        assert isinstance(kind, BoardKind)
        assert kind.missing() is None
        assert kind.parse(kind.example.partition(" ")[0]).kind == kind.name


@given(columns=st.integers(3, 300), rows=st.integers(3, 300), side=lengths)
def test_a_checkerboards_own_description_makes_it_again(columns: int, rows: int, side: float) -> None:
    board = Checkerboard(columns, rows, side)
    assert CheckerboardKind().parse(board.spec) == board


@settings(max_examples=50)
@given(
    columns=st.integers(3, 30),
    rows=st.integers(3, 30),
    side=lengths,
    part=st.floats(0.1, 0.95),
    inverted=st.booleans(),
    legacy=st.booleans(),
    bits=st.sampled_from([4, 5, 6, 7]),
)
def test_a_charuco_boards_own_description_makes_it_again(
    columns: int, rows: int, side: float, part: float, inverted: bool, legacy: bool, bits: int
) -> None:
    board = CharucoBoard(columns, rows, side, part * side, f"DICT_{bits}X{bits}_1000", inverted, legacy)
    assert CharucoKind().parse(board.spec) == board


@pytest.mark.parametrize(
    ("spec", "said"),
    [
        ("checkerboard", "number of inner corners is missing"),
        ("checkerboard:18x23", "size of a square is missing"),
        ("checkerboard:18x23:", "size of a square is missing"),
        ("checkerboard:18x23:50", "has no unit"),
        ("checkerboard:18x23:50 parsec", "unknown unit"),
        ("checkerboard:18x23:0mm", "not a usable length"),
        ("checkerboard:18x23:-50mm", "not a length"),
        ("checkerboard:18x23:nanmm", "not a length"),
        ("checkerboard:18x23:50mm:7", "too much"),
        ("checkerboard:18:50mm", "with an x between them"),
        ("checkerboard:18x:50mm", "with an x between them"),
        ("checkerboard:1.5x4:50mm", "with an x between them"),
        ("checkerboard:0x23:50mm", "must not be zero"),
        ("checkerboard:2x23:50mm", "at least 3 inner corners"),
        ("checkerboard:٣x٤:50mm", "with an x between them"),
        ("checkerboard:999999x999999:50mm", "cannot be used"),
        (f"checkerboard:{'9' * 5000}x4:50mm", "with an x between them"),
        ("charuco:5x7", "size of a square is missing"),
        ("charuco:5x7:30mm", "size of a marker is missing"),
        ("charuco:5x7:30mm:DICT_4X4_50", "size of a marker: 'DICT_4X4_50' is not a length"),
        ("charuco:5x7:30mm:22mm", "dictionary of the markers is missing"),
        ("charuco:5x7:22mm:30mm:DICT_4X4_50", "give the square's size first"),
        ("charuco:5x7:30mm:22mm:DICT_3X3_50", "DICT_APRILTAG_36h11"),
        ("charuco:25x17:30mm:22mm:DICT_4X4_50", "has 212 markers, but DICT_4X4_50 has only 50"),
        ("charuco:5x7:30mm:22mm:DICT_4X4_50:white", "only inverted and legacy"),
        ("charuco:5x0:30mm:22mm:DICT_4X4_50", "must not be zero"),
    ],
)
def test_what_is_refused_and_how_it_is_said(spec: str, said: str) -> None:
    kind = CharucoKind() if spec.startswith("charuco") else CheckerboardKind()
    with pytest.raises(BoardSpecError) as caught:
        kind.parse(spec)
    message = str(caught.value)
    assert said in message
    assert kind.grammar in message
    assert kind.example in message
    assert "\n" not in message


def test_spaces_and_other_units_are_understood() -> None:
    assert CheckerboardKind().parse("checkerboard: 18 x 23 : 5 cm") == Checkerboard(18, 23, 0.05)
    assert CheckerboardKind().parse("checkerboard:18X23:2in") == Checkerboard(18, 23, 2 * 0.0254)
    assert CharucoKind().parse("charuco:5x7:3cm:22mm:dict_apriltag_36H11").spec.endswith(":DICT_APRILTAG_36h11")


def test_dictionaries_are_all_of_opencvs() -> None:
    names = {name for name in dir(cv2.aruco) if name.startswith("DICT_")}
    aliases = {name for name in names if name.endswith(("H5", "H9", "H10", "H11", "H12"))}
    assert set(DICTIONARIES) == names - aliases
    for name, count in DICTIONARIES.items():
        assert len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name)).bytesList) == count


def test_a_checkerboard_is_dark_next_to_the_first_corner() -> None:
    drawing = CheckerboardKind().draw(Checkerboard(4, 3, 0.02))
    page = rastered(drawing, 0.02)
    np.testing.assert_array_equal(page == 0, np.indices((4, 5)).sum(axis=0) % 2 == 0)
    assert drawing.origin_m == (0.02, 0.02)
    assert (drawing.width_m, drawing.height_m) == pytest.approx((0.1, 0.08))


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("size", [(5, 4), (4, 5), (6, 4), (5, 7)])
@pytest.mark.parametrize("dictionary", ["DICT_4X4_50", "DICT_7X7_100", "DICT_APRILTAG_36h11", "DICT_ARUCO_ORIGINAL"])
def test_a_charuco_board_is_drawn_as_opencv_draws_it(
    size: tuple[int, int], dictionary: str, inverted: bool, legacy: bool
) -> None:
    opencv_dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    modules = opencv_dictionary.markerSize + 2
    square, marker = 2 * (modules + 4), 2 * modules  # pixels, whole ones a module
    made = cv2.aruco.CharucoBoard(size, float(square), float(marker), opencv_dictionary)
    made.setLegacyPattern(legacy)
    expected = made.generateImage((size[0] * square, size[1] * square))
    board = CharucoBoard(*size, square * 1e-3, marker * 1e-3, dictionary, inverted, legacy)
    drawing = CharucoKind().draw(board)
    assert drawing.dark is inverted
    np.testing.assert_array_equal(rastered(drawing, 1e-3), 255 - expected if inverted else expected)
    corners = made.getChessboardCorners() * 1e-3
    np.testing.assert_allclose(board.points + np.append(drawing.origin_m, 0.0), corners, atol=1e-9)


def test_a_board_of_another_kind_is_not_drawn() -> None:
    with pytest.raises(BoardSpecError, match="cannot be drawn as a ChArUco"):
        CharucoKind().draw(Checkerboard(4, 3, 0.02))
    with pytest.raises(BoardSpecError, match="cannot be drawn as a plain"):
        CheckerboardKind().draw(CharucoBoard(4, 3, 0.02, 0.01, "DICT_4X4_50"))


def test_parsing_needs_no_opencv_and_drawing_says_so() -> None:
    program = """
from importlib.machinery import PathFinder
found = PathFinder.find_spec
PathFinder.find_spec = lambda name, *rest: None if name == "cv2" else found(name, *rest)
from opencsp_calib_opencv.board_kinds import CharucoKind, CheckerboardKind
from opencsp_calib.errors import MissingDependencyError
print(CheckerboardKind().parse("checkerboard:18x23:50mm").spec, CheckerboardKind().missing())
board = CharucoKind().parse("charuco:5x7:30mm:22mm:DICT_4X4_50")
try:
    CharucoKind().draw(board)
except MissingDependencyError as error:
    print(error)
"""
    run = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    first, second = run.stdout.splitlines()
    assert first == "checkerboard:18x23:50mm None"
    assert "pip install" in second
