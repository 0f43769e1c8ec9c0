"""Printed boards have their true size, read back from each format by a reader of its own, and OpenCV finds them."""

import re
import struct
from pathlib import Path

import cv2
import numpy as np
import pypdfium2 as pdfium
import pytest
from defusedxml import ElementTree
from opencsp_calib_opencv.board_kinds import CharucoKind, CheckerboardKind

from opencsp_calib import Board, Checkerboard, InputError
from opencsp_calib.drawing import Drawing, write_board

CHECKERBOARD = CheckerboardKind().parse("checkerboard:9x6:12.7mm")
CHARUCO = CharucoKind().parse("charuco:5x4:20mm:15mm:DICT_4X4_50")
INVERTED = CharucoKind().parse("charuco:5x4:20mm:15mm:DICT_4X4_50:inverted")
BOARDS = [CHECKERBOARD, CHARUCO, INVERTED]


def drawn(board: Board) -> Drawing:
    return (CharucoKind() if board.kind == "charuco" else CheckerboardKind()).draw(board)


def read_png(path: Path) -> tuple[np.ndarray, float]:
    """Grey levels, and metres a dot as the file states them."""
    data = path.read_bytes()
    across, down, unit = struct.unpack(">IIB", data[data.index(b"pHYs") + 4 :][:9])
    assert (across, unit) == (down, 1)
    return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED), 1.0 / across


def read_pdf(path: Path) -> tuple[np.ndarray, float]:
    document = pdfium.PdfDocument(path)
    assert len(document) == 1
    width, _ = document[0].get_size()
    page = document[0].render(scale=5, grayscale=True).to_numpy()
    document.close()
    return page.reshape(page.shape[:2]), width * 0.0254 / 72 / page.shape[1]


def words_of(path: Path) -> str:
    """All that is written in an SVG or a PDF, without spaces at the ends of its lines."""
    if path.suffix == ".svg":
        return "\n".join(text.strip() for text in ElementTree.parse(path).getroot().itertext())
    document = pdfium.PdfDocument(path)
    text = document[0].get_textpage().get_text_range()
    document.close()
    return str(text)


def read_svg(path: Path) -> tuple[np.ndarray, float]:
    """The boxes and the size of the page, painted at 0.1 mm a dot."""
    root = ElementTree.parse(path).getroot()
    assert root.get("width").endswith("mm")
    width, height = float(root.get("width")[:-2]), float(root.get("height")[:-2])
    assert [float(v) for v in root.get("viewBox").split()] == [0, 0, width, height]
    page = np.full((round(height * 10), round(width * 10)), 255, np.uint8)
    outline = root.find("{http://www.w3.org/2000/svg}path").get("d")
    for left, top, right, bottom in re.findall(r"M([\d.]+) ([\d.]+)H([\d.]+)V([\d.]+)H\1Z", outline):
        x0, y0, x1, y1 = (round(float(v) * 10) for v in (left, top, right, bottom))
        page[y0:y1, x0:x1] = 0
    return page, 1e-4


READERS = {".png": read_png, ".pdf": read_pdf, ".svg": read_svg}


@pytest.mark.parametrize("extension", READERS)
@pytest.mark.parametrize("board", BOARDS, ids=lambda b: b.spec)
def test_opencv_finds_the_board_at_its_true_size(board: Board, extension: str, tmp_path: Path) -> None:
    path = tmp_path / f"board{extension}"
    write_board(board, drawn(board), path)
    page, metres = READERS[extension](path)
    columns, rows = board.grid
    if board.kind == "checkerboard":
        found, corners = cv2.findChessboardCornersSB(page, board.grid, flags=cv2.CALIB_CB_ACCURACY)
        assert found
        corners = corners.reshape(-1, 2)
        if corners[0, 0] > corners[-1, 0]:
            corners = corners[::-1]
    else:
        dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
        opencv_board = cv2.aruco.CharucoBoard((5, 4), 0.02, 0.015, dictionary)
        corners, ids, _, _ = cv2.aruco.CharucoDetector(opencv_board).detectBoard(255 - page if board.inverted else page)
        assert ids.ravel().tolist() == list(range(12))
        corners = corners.reshape(-1, 2)
    measured = (corners + 0.5) * metres
    expected = board.points[:, :2] + 2 * board.spacing_m  # the margin, and the outermost square
    assert np.abs(measured - expected).max() < 0.5 * metres
    across = measured.reshape(rows, columns, 2)
    assert across[:, -1, 0] - across[:, 0, 0] == pytest.approx((columns - 1) * board.spacing_m, abs=0.3 * metres)


@pytest.mark.parametrize("extension", READERS)
def test_the_bar_is_as_long_as_is_written_beside_it(extension: str, tmp_path: Path) -> None:
    path = tmp_path / f"board{extension}"
    write_board(CHECKERBOARD, drawn(CHECKERBOARD), path)
    page, metres = READERS[extension](path)
    foot = page[round((7 + 2) * CHECKERBOARD.spacing_m / metres) + 1 :]
    dark = (foot < 128).sum(axis=1)
    bar = dark[np.flatnonzero(dark)[0] + 1]
    assert bar * metres == pytest.approx(0.05, abs=metres)  # half of 152 mm allows 50 mm
    if extension == ".svg":
        assert "this bar is 50 mm long" in path.read_text()


@pytest.mark.parametrize("board", BOARDS, ids=lambda b: b.spec)
def test_the_margin_is_a_square_of_the_boards_ground(board: Board, tmp_path: Path) -> None:
    write_board(board, drawn(board), tmp_path / "board.png")
    page, metres = read_png(tmp_path / "board.png")
    margin = int(board.spacing_m / metres) - 1
    ground = 0 if board is INVERTED else 255
    board_foot = int((drawn(board).height_m + 2 * board.spacing_m) / metres) - 1
    for strip in (page[:margin, :-1], page[:board_foot, :margin], page[:board_foot, -margin:-1]):
        assert (strip == ground).all()
    assert (page[-3:] == 255).all(), "below the notes the page is white"
    assert (page[:, -1:][board_foot + 3 :] == 255).all(), "the notes fit on the page"


def test_the_notes_say_what_it_is(tmp_path: Path) -> None:
    for extension in (".svg", ".pdf"):
        write_board(INVERTED, drawn(INVERTED), tmp_path / f"board{extension}")
        assert INVERTED.spec in words_of(tmp_path / f"board{extension}").split()


def test_dots_black_in_part_are_grey(tmp_path: Path) -> None:
    """12.7 mm are 150 dots of an inch's 300, but the format counts dots a metre, 11811: edges drift by 0.0003 dots."""
    board = CheckerboardKind().parse("checkerboard:3x3:10.01mm")
    write_board(board, drawn(board), tmp_path / "board.png")
    page, metres = read_png(tmp_path / "board.png")
    middle = page[round(1.5 * board.spacing_m / metres)].astype(float)
    black = ((255 - middle) / 255).sum() * metres
    assert black == pytest.approx(2 * board.spacing_m, abs=0.01 * metres)
    assert np.unique(page).size > 10


def test_a_name_that_ends_in_nothing_known_is_refused(tmp_path: Path) -> None:
    for name in ("board.jpg", "board", "board.svgz"):
        with pytest.raises(InputError, match=r"\.svg, \.pdf or \.png"):
            write_board(CHECKERBOARD, drawn(CHECKERBOARD), tmp_path / name)
    with pytest.raises(InputError, match="does not exist"):
        write_board(CHECKERBOARD, drawn(CHECKERBOARD), tmp_path / "nowhere" / "board.svg")
    assert list(tmp_path.iterdir()) == []


def test_boards_too_large_for_a_format_are_refused_and_leave_nothing(tmp_path: Path) -> None:
    board = CheckerboardKind().parse("checkerboard:9x6:1m")
    with pytest.raises(InputError, match=r"5\.08 m"):
        write_board(board, drawn(board), tmp_path / "board.pdf")
    with pytest.raises(InputError, match=r"\.pdf or \.svg"):
        write_board(board, drawn(board), tmp_path / "board.png")
    assert list(tmp_path.iterdir()) == []
    write_board(board, drawn(board), tmp_path / "board.SVG")


def test_letters_that_mean_something_to_a_format_or_have_accents_are_printed(tmp_path: Path) -> None:
    class Odd(Checkerboard):  # a third party's board
        @property
        def spec(self) -> str:
            return "odd:<&\\)(é>"

    board = Odd(9, 6, 0.02)
    for extension in READERS:
        write_board(board, drawn(CHECKERBOARD), tmp_path / f"board{extension}")
    for extension in (".svg", ".pdf"):
        assert "odd:<&\\)(é>" in words_of(tmp_path / f"board{extension}")
