"""From a photograph to trusted corners, as every command does it: what is accepted is right, the rest has a reason."""

import cv2
import numpy as np
import pytest
from board_photographs import SIZE, Photograph
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from opencsp_calib_opencv.board_kinds import CharucoKind

from opencsp_calib import Board, CharucoBoard, Checkerboard, Detection, Image, InputError
from opencsp_calib.arrays import Floats
from opencsp_calib.looking import find_board
from opencsp_calib.registry import installed
from opencsp_calib.rendering import Exposure, Scene, Spot

BOARD = Checkerboard(9, 6, 0.03)
CHARUCO = CharucoBoard(8, 6, 0.04, marker_m=0.03, dictionary="DICT_5X5_100")
PLAIN = Scene(room=1)


def found(image: Image, board: Board) -> Detection:
    """By default detection and the fit."""
    detection = find_board(image, board, installed().detector_for(board), "model")
    assert len(detection) or detection.reason
    return detection


def photograph_of(board: Board, **how: object) -> Photograph:
    drawing = CharucoKind().draw(board) if isinstance(board, CharucoBoard) else None
    return Photograph.of(board, drawing=drawing, **how)  # type: ignore[arg-type]  # keywords, as they are


def processed(grey: Floats, sharpening: float, quality: int) -> Floats:
    """As a phone does it."""
    grey = grey + sharpening * (grey - cv2.GaussianBlur(grey, (0, 0), 1.0))
    file = cv2.imencode(".jpg", np.clip(np.rint(grey), 0, 255).astype(np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(file, cv2.IMREAD_GRAYSCALE))


@pytest.mark.parametrize("board", [BOARD, CHARUCO], ids=["checkerboard", "charuco"])
@pytest.mark.parametrize("period_px", [2.1, 3.3, 7.0])
def test_a_screen_with_moire(board: Board, period_px: float) -> None:
    photograph = photograph_of(board, scene=PLAIN)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    waves = np.cos(2 * np.pi * (x + 0.1 * y) / period_px) * np.cos(2 * np.pi * (y - 0.07 * x) / period_px)
    pixels = np.clip(photograph.image.pixels * (1 + 0.25 * waves), 0, 255).astype(np.uint8)
    detection = found(Image("screen", pixels), board)
    assert len(detection) > 0.9 * len(board.points)
    assert photograph.off_px(detection).max() < 0.1


@pytest.mark.parametrize("board", [BOARD, CHARUCO], ids=["checkerboard", "charuco"])
def test_half_a_board_covered_by_something_straight(board: Board) -> None:
    photograph = photograph_of(board, tilt_deg=10, roll_deg=0, scene=PLAIN)
    pixels = photograph.image.pixels.copy()
    pixels[:, :340] = 90  # five columns of the checkerboard are left
    detection = found(Image("half", pixels), board)
    left = photograph.pixels[:, 0] - 340
    assert set(detection.ids) <= set(np.flatnonzero(left > -1))
    assert len(detection) >= 0.8 * (left > 30).sum()
    assert photograph.off_px(detection).max() < 0.1


def test_two_corners_too_few_are_no_view() -> None:
    board = Checkerboard(3, 3, 0.03)
    plain = photograph_of(board, tilt_deg=0, scene=PLAIN)
    spots = tuple(Spot(*plain.pixels[i], 30.0, 120.0) for i in (0, 1, 2, 4))
    detection = found(photograph_of(board, tilt_deg=0, scene=Scene(room=1, occluders=spots)).image, board)
    assert len(detection) == 0
    assert detection.reason


SIDES = st.integers(3, 9)
UNIT = st.floats(0, 1)
SPOT = st.builds(Spot, st.floats(0, SIZE[0]), st.floats(0, SIZE[1]), st.floats(2, 90), st.floats(0, 255))


@settings(max_examples=20)
@given(
    grid=st.tuples(SIDES, SIDES),
    charuco=st.booleans(),
    angles=st.tuples(st.floats(0, 55), st.floats(0, 360), st.floats(-180, 180)),
    size=st.tuples(st.floats(0.3, 0.95), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
    spots=st.tuples(st.lists(SPOT, max_size=3), st.lists(SPOT, max_size=2)),
    exposure=st.tuples(st.floats(0.3, 2), st.floats(0.5, 6), st.sampled_from([0.4, 1.0, 1.8])),
    process=st.tuples(st.floats(0, 2), st.integers(30, 95)),
)
def test_whatever_is_accepted_is_where_it_says(
    grid: tuple[int, int],
    charuco: bool,
    angles: tuple[float, float, float],
    size: tuple[float, float, float],
    spots: tuple[list[Spot], list[Spot]],
    exposure: tuple[float, float, float],
    process: tuple[float, int],
) -> None:
    board: Board = Checkerboard(*grid, 0.03)
    if charuco:
        board = CharucoBoard(*grid, 0.04, marker_m=0.03, dictionary="DICT_5X5_100")
    tilt_deg, azimuth_deg, roll_deg = angles
    psf_px, noise, gain = exposure
    try:
        photograph = photograph_of(
            board, tilt_deg=tilt_deg, azimuth_deg=azimuth_deg, roll_deg=roll_deg, fill=size[0], shift=size[1:],
            scene=Scene(occluders=tuple(spots[0]), glare=tuple(spots[1])),
            exposure=Exposure(psf_px=psf_px, noise=noise, gain=gain),
        )  # fmt: skip
    except InputError:
        assume(False)
    assume(np.isfinite(photograph.pixels).all())
    image = Image("phone", processed(photograph.image.pixels.astype(np.float64), *process))
    detection = found(image, board)
    if len(detection):
        assert detection.covariance is not None
        off = photograph.off_px(detection)
        stated = np.sqrt(np.trace(detection.covariance, axis1=1, axis2=2))
        assert np.median(off) < 0.2
        assert (off < np.maximum(0.3, 5 * stated)).all()
