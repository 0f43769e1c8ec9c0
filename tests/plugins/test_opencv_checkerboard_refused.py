"""What is no checkerboard, or another one than asked for, is refused with the reason."""

import cv2
import numpy as np
import pytest
from board_photographs import NEAR_PX, SIZE, Photograph, detected
from hypothesis import given, settings
from hypothesis import strategies as st
from opencsp_calib_opencv.checkerboard import CheckerboardDetector
from opencsp_calib_opencv.opencsp import OpenCSPDetector
from opencsp_calib_opencv.rings import sample

from opencsp_calib import Checkerboard, Detection, Image
from opencsp_calib.rendering import Scene

BOARD = Checkerboard(9, 6, 0.05)
PLAIN = Scene(clutter=0.0)


def find(image: Image, board: Checkerboard = BOARD) -> Detection:
    return detected(CheckerboardDetector(), image, board)


def picture(kind: str) -> np.ndarray:
    rng = np.random.default_rng(1)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    if kind == "text":
        page = np.full(SIZE[::-1], 240, dtype=np.uint8)
        for line in range(20, 600, 18):
            text = "".join(chr(c) for c in rng.integers(33, 126, 60))
            cv2.putText(page, text, (5, line), cv2.FONT_HERSHEY_SIMPLEX, 0.6, 20, 1)
        return page
    waves = 60 * np.sin(2.9 * x) * np.sin(2.95 * y) + 50 * np.sin(0.3 * x + 0.02 * y)
    grey = {
        "blank": np.full_like(x, 128),
        "black": np.zeros_like(x),
        "saturated": np.full_like(x, 255),
        "noise": rng.integers(0, 256, x.shape),
        "faint noise": np.clip(128 + rng.normal(0, 3, x.shape), 0, 255),
        "moire": 128 + waves,
        "stripes": 255 * (x % 16 < 8),
        "tiled floor": 255 * ((x // 8 + y // 8) % 2),
        "waves": 128 + 100 * np.sin(0.2 * x) * np.sin(0.2 * y),
    }[kind]
    return grey.astype(np.uint8)


REASONS = {
    "blank": "one grey",
    "black": "black",
    "saturated": "saturated",
    "noise": "no 9x6 checkerboard",
    "faint noise": "no 9x6 checkerboard",
    "text": "no 9x6 checkerboard",
    "moire": "checkerboard",
    "stripes": "no 9x6 checkerboard",
    "tiled floor": "inner corners, not 9x6",
    "waves": "inner corners, not 9x6",
}


@pytest.mark.parametrize("kind", REASONS)
def test_what_is_no_board_has_a_reason(kind: str) -> None:
    detection = find(Image(kind, picture(kind)))
    assert len(detection) == 0
    assert REASONS[kind] in detection.reason


@pytest.mark.parametrize(
    ("grid", "reason"),
    [
        ((10, 7), "has 9x6 inner corners, not 10x7, which counts its squares"),
        ((7, 10), "write checkerboard:6x9:50mm"),
        ((8, 6), "has 9x6 inner corners, not 8x6"),
        ((9, 7), "has 9x6 inner corners, not 9x7"),
        ((20, 20), "has 9x6 inner corners, not 20x20"),
    ],
)
def test_another_board_is_named(grid: tuple[int, int], reason: str) -> None:
    detection = find(Photograph.of(BOARD, scene=PLAIN).image, Checkerboard(*grid, 0.05))
    assert len(detection) == 0
    assert detection.other_board
    assert reason in detection.reason


def test_two_boards_are_never_mixed() -> None:
    one = Photograph.of(BOARD, fill=0.7)
    two = Image("two", np.hstack([one.image.pixels, one.image.pixels]))
    detection = find(two)
    assert len(detection) == 0
    assert "two 9x6 checkerboards" in detection.reason


def test_a_much_smaller_board_in_the_background_is_left_alone() -> None:
    near, far = Photograph.of(BOARD, fill=0.9), Photograph.of(BOARD, fill=0.25)
    both = Image("both", np.vstack([near.image.pixels, far.image.pixels]))
    detection = find(both)
    assert len(detection) == 54
    assert near.farthest_px(detection) < NEAR_PX


@pytest.mark.parametrize("shape", [(1, 1), (20, 20), (1, 3000), (3000, 17), (15, 400)])
def test_tiny_and_thin_images(shape: tuple[int, int]) -> None:
    noise = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    for detector in (CheckerboardDetector(), OpenCSPDetector()):
        detection = detector.detect(Image("tiny", noise), BOARD)
        assert len(detection) == 0
        assert detection.reason


@settings(max_examples=30)
@given(
    pixels=st.tuples(st.integers(1, 90), st.integers(1, 90), st.integers(0, 2**32 - 1)),
    deep=st.booleans(),
    block=st.integers(1, 12),
)
def test_no_image_makes_it_fail(pixels: tuple[int, int, int], deep: bool, block: int) -> None:
    rng = np.random.default_rng(pixels[2])
    kind = np.uint16 if deep else np.uint8
    noise = rng.integers(0, np.iinfo(kind).max, pixels[:2], dtype=kind, endpoint=True)
    image = Image("any", np.kron(noise, np.ones((block, block), dtype=kind)))
    assert len(find(image, Checkerboard(3, 3, 0.01))) < 9


def test_more_places_can_be_looked_at_than_opencv_takes_at_once() -> None:
    columns, rows = np.meshgrid(np.arange(20, dtype=np.float32), np.arange(20, dtype=np.float32))
    places = np.random.default_rng(0).uniform(0, 19, (70_000, 2, 2))
    assert np.allclose(sample(columns + 20 * rows, places), places @ [1, 20], atol=21 / 32)
