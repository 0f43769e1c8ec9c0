"""ChArUco boards are found whole or in part; a board that is another one is named, with how to write it."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from board_photographs import NEAR_PX, SIZE, Photograph, detected
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from opencsp_calib_opencv.board_kinds import CharucoKind
from opencsp_calib_opencv.charuco import CharucoDetector

from opencsp_calib import CharucoBoard, Detection, Image
from opencsp_calib.corners import refine
from opencsp_calib.errors import InputError
from opencsp_calib.images import find_images, read_image
from opencsp_calib.rendering import Exposure, Scene, Spot

CALISCOPE = CharucoKind().parse("charuco:4x5:54mm:40.5mm:DICT_4X4_50:inverted")
BOARD = CharucoBoard(8, 6, 0.04, marker_m=0.03, dictionary="DICT_5X5_100")


def find(image: Image, board: CharucoBoard = BOARD) -> Detection:
    return detected(CharucoDetector(), image, board)


def photograph_of(board: CharucoBoard, **how: object) -> Photograph:
    return Photograph.of(board, drawing=CharucoKind().draw(board), **how)  # type: ignore[arg-type]  # keywords, as they are


def like(board: CharucoBoard, **changes: object) -> CharucoBoard:
    return replace(board, points=None, **changes)  # type: ignore[arg-type]  # the nominal points of the new board


# Real photographs


def test_the_eleven_frames_that_show_the_board_and_none_of_the_three_that_do_not(data_dir: Path) -> None:
    found = {file.name: find(read_image(file), CALISCOPE) for file in find_images(data_dir / "charuco_inverted")}
    empty = {name for name, detection in found.items() if not len(detection)}
    assert empty == {"frame_0056.jpg", "frame_0060.jpg", "frame_0064.jpg"}
    assert all(len(detection) == 12 for name, detection in found.items() if name not in empty)


def test_the_fit_keeps_the_corners_of_sharpened_and_compressed_frames_and_they_fit_one_camera(data_dir: Path) -> None:
    frames = [read_image(file) for file in find_images(data_dir / "charuco_inverted")]
    refined = [refine(frame, found, CALISCOPE) for frame in frames if len(found := find(frame, CALISCOPE))]
    assert [len(detection) for detection in refined] == 11 * [12]
    points = 11 * [CALISCOPE.points.astype(np.float32)]
    pixels = [detection.pixels.astype(np.float32) for detection in refined]
    flags = cv2.CALIB_FIX_K3 + cv2.CALIB_ZERO_TANGENT_DIST
    rms_px = cv2.calibrateCamera(points, pixels, frames[0].size, None, None, flags=flags)[0]  # type: ignore[call-overload]  # None is a guess
    assert rms_px < 0.06  # as they are found: 0.10


def test_the_corners_are_those_that_opencv_finds(data_dir: Path) -> None:
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    opencv = cv2.aruco.CharucoDetector(cv2.aruco.CharucoBoard((4, 5), 0.054, 0.0405, dictionary))
    image = read_image(next(f for f in find_images(data_dir / "charuco_inverted") if f.name == "frame_0076.jpg"))
    corners, ids, _, _ = opencv.detectBoard(255 - image.pixels)
    detection = find(image, CALISCOPE)
    assert np.array_equal(detection.ids, np.ravel(ids))
    assert np.linalg.norm(detection.pixels - np.reshape(corners, (-1, 2)), axis=1).max() < NEAR_PX


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"inverted": False}, "printed white on black: write :inverted"),
        ({"dictionary": "DICT_6X6_250"}, "found 10 markers of DICT_4X4_50, none of DICT_6X6_250"),
        ({"columns": 5, "rows": 4}, "columns and rows look exchanged"),
        ({"columns": 7}, "arranged in 4 columns of squares, not 7"),
        ({"marker_m": 0.02}, "of a square wide, not 0.37: measure one"),
    ],
)
def test_a_wrong_description_is_put_right(data_dir: Path, changes: dict[str, object], reason: str) -> None:
    image = read_image(next(f for f in find_images(data_dir / "charuco_inverted") if f.name == "frame_0076.jpg"))
    detection = find(image, like(CALISCOPE, **changes))
    assert len(detection) == 0
    assert reason in detection.reason


# Rendered photographs


@pytest.mark.parametrize(
    "changes", [{}, {"inverted": True}, {"legacy": True}, {"columns": 5, "rows": 9}, {"columns": 3, "rows": 3}]
)
@pytest.mark.parametrize("roll_deg", [0, 100, 230])
def test_whole_boards(changes: dict[str, object], roll_deg: float) -> None:
    board = like(BOARD, **changes)
    photograph = photograph_of(board, roll_deg=roll_deg)
    detection = find(photograph.image, board)
    assert len(detection) == len(board.points), detection.reason
    assert photograph.farthest_px(detection) < NEAR_PX


@pytest.mark.parametrize("shift", [(0.4, 0.0), (-0.3, 0.3), (0.0, -0.4)])
def test_parts_of_boards(shift: tuple[float, float]) -> None:
    photograph = photograph_of(BOARD, shift=shift)
    inside = ((photograph.pixels > 10) & (photograph.pixels < np.array(SIZE) - 10)).all(axis=1).sum()
    detection = find(photograph.image)
    assert 0.7 * inside <= len(detection) < len(BOARD.points)
    assert photograph.farthest_px(detection) < NEAR_PX
    assert "out of view" in detection.reason


def test_sixteen_bits_in_dim_light() -> None:
    photograph = photograph_of(BOARD, exposure=Exposure(bits=16, gain=0.1))
    assert len(find(photograph.image)) == len(BOARD.points)


@pytest.mark.parametrize("legacy", [False, True])
def test_the_other_layout_is_recognised(legacy: bool) -> None:
    photograph = photograph_of(like(BOARD, legacy=legacy))
    detection = find(photograph.image, like(BOARD, legacy=not legacy))
    assert len(detection) == 0
    assert ("write :legacy" if legacy else "leave out :legacy") in detection.reason


def test_where_the_number_of_rows_is_odd_both_layouts_are_the_same() -> None:
    photograph = photograph_of(like(BOARD, rows=5, legacy=True))
    assert len(find(photograph.image, like(BOARD, rows=5))) == len(like(BOARD, rows=5).points)


def test_black_on_white_is_recognised() -> None:
    detection = find(photograph_of(BOARD).image, like(BOARD, inverted=True))
    assert len(detection) == 0
    assert "printed black on white: leave out :inverted" in detection.reason


@pytest.mark.parametrize(
    "dictionary", ["DICT_4X4_50", "DICT_6X6_250", "DICT_7X7_1000", "DICT_APRILTAG_36h11", "DICT_ARUCO_ORIGINAL"]
)
def test_the_dictionary_is_named(dictionary: str) -> None:
    shown = like(BOARD, dictionary=dictionary)
    detection = find(photograph_of(shown).image)
    assert len(detection) == 0
    named = detection.reason.split(" of ")[1].split(",")[0]
    assert detection.reason == f"found 24 markers of {named}, none of DICT_5X5_100"
    # a small dictionary is the beginning of the larger ones
    assert named == dictionary or (named, dictionary) in {
        ("DICT_6X6_50", "DICT_6X6_250"),
        ("DICT_7X7_50", "DICT_7X7_1000"),
    }


def test_a_mirror_is_recognised() -> None:
    mirrored = np.ascontiguousarray(photograph_of(BOARD).image.pixels[:, ::-1])
    detection = find(Image("mirrored", mirrored))
    assert len(detection) == 0
    assert "mirrored" in detection.reason


def test_two_boards_are_never_mixed() -> None:
    pixels = photograph_of(BOARD).image.pixels
    detection = find(Image("two", np.hstack([pixels, pixels])))
    assert len(detection) == 0
    assert "twice" in detection.reason


def test_what_is_covered_is_left_out() -> None:
    photograph = photograph_of(BOARD)
    x, y = photograph.pixels[2 * 7 + 3]
    covered = photograph_of(BOARD, scene=Scene(occluders=(Spot(float(x), float(y), 60.0, 120.0),)))
    detection = find(covered.image)
    assert 2 * 7 + 3 not in detection.ids
    assert len(detection) > len(BOARD.points) / 2
    assert covered.farthest_px(detection) < NEAR_PX


# What is not the board


def picture(kind: str) -> np.ndarray:
    rng = np.random.default_rng(2)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    grey = {
        "blank": np.full_like(x, 128),
        "black": np.zeros_like(x),
        "saturated": np.full_like(x, 255),
        "noise": rng.integers(0, 256, x.shape),
        "small tiles": 255 * ((x // 10 + y // 10) % 2),
        "large tiles": 255 * ((x // 40 + y // 40) % 2),
    }[kind]
    return grey.astype(np.uint8)


@pytest.mark.parametrize(
    ("kind", "reason"),
    [
        ("blank", "one grey"),
        ("black", "black"),
        ("saturated", "saturated"),
        ("noise", "marker"),
        ("small tiles", "marker"),
        ("large tiles", "no marker of DICT_5X5_100, nor of any other dictionary"),
    ],
)
def test_what_is_no_board_has_a_reason(kind: str, reason: str) -> None:
    detection = find(Image(kind, picture(kind)))
    assert len(detection) == 0
    assert reason in detection.reason


@pytest.mark.parametrize("shape", [(1, 1), (20, 20), (1, 3000), (3000, 17)])
def test_tiny_and_thin_images(shape: tuple[int, int]) -> None:
    noise = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    assert len(find(Image("tiny", noise))) == 0


def test_a_hundred_megapixels() -> None:
    photograph = photograph_of(BOARD)
    large = cv2.resize(photograph.image.pixels, None, fx=14.5, fy=14.5, interpolation=cv2.INTER_CUBIC)
    assert len(find(Image("large", large))) == len(BOARD.points)


# Properties

UNIT = st.floats(0, 1)


@settings(max_examples=25)
@given(
    grid=st.tuples(st.integers(3, 10), st.integers(3, 10)),
    marker=st.floats(0.6, 0.8),
    kind=st.tuples(st.booleans(), st.booleans()),
    angles=st.tuples(st.floats(0, 50), st.floats(0, 360), st.floats(-180, 180)),
    shift=st.tuples(st.floats(-0.35, 0.35), st.floats(-0.35, 0.35)),
    spot=st.tuples(UNIT, UNIT, st.floats(1, 120), st.floats(0, 255)),
)
def test_accepted_corners_are_where_they_should_be(
    grid: tuple[int, int],
    marker: float,
    kind: tuple[bool, bool],
    angles: tuple[float, float, float],
    shift: tuple[float, float],
    spot: tuple[float, float, float, float],
) -> None:
    inverted, legacy = kind
    board = CharucoBoard(
        *grid, 0.04, marker_m=0.04 * marker, dictionary="DICT_5X5_100", inverted=inverted, legacy=legacy
    )
    tilt_deg, azimuth_deg, roll_deg = angles
    scene = Scene(occluders=(Spot(spot[0] * SIZE[0], spot[1] * SIZE[1], *spot[2:]),))
    try:
        photograph = photograph_of(
            board, tilt_deg=tilt_deg, azimuth_deg=azimuth_deg, roll_deg=roll_deg, shift=shift, scene=scene
        )
    except InputError:
        assume(False)
    assume(np.isfinite(photograph.pixels).all())
    assert photograph.farthest_px(find(photograph.image, board)) < NEAR_PX
