"""`cornerSubPix` with a window that follows the squares: as the seed's where these are large, unharmed where small."""

import cv2
import numpy as np
import pytest
from board_photographs import Photograph

from opencsp_calib import Checkerboard, Detection, Image
from opencsp_calib.subpix import refine_subpix

BOARD = Checkerboard(9, 6, 0.05)
UNTIL = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 40, 0.001)


def near(photograph: Photograph, off_px: float = 0.7) -> Detection:
    offset = np.random.default_rng(0).uniform(-off_px, off_px, photograph.pixels.shape)
    return Detection(np.arange(len(photograph.pixels)), photograph.pixels + offset)


def in_the_seeds_way(photograph: Photograph, start: Detection) -> Detection:
    """With a window that is the same for all."""
    near = start.pixels.astype(np.float32).reshape(-1, 1, 2)
    found = cv2.cornerSubPix(photograph.image.pixels, near, (11, 11), (-1, -1), UNTIL)
    return Detection(start.ids, found.reshape(-1, 2))


def rms_px(detection: Detection, photograph: Photograph) -> float:
    return float(np.sqrt(((detection.pixels - photograph.pixels) ** 2).sum(axis=1).mean()))


def test_on_large_squares_it_is_the_seeds_way() -> None:
    photograph = Photograph.of(BOARD)
    start = near(photograph)
    expected = in_the_seeds_way(photograph, start)
    assert np.abs(refine_subpix(photograph.image, start).pixels - expected.pixels).max() < 1e-3


def test_on_small_squares_the_window_does_not_swallow_neighbours() -> None:
    photograph = Photograph.of(BOARD, fill=0.17)
    start = near(photograph)
    assert rms_px(in_the_seeds_way(photograph, start), photograph) > 1
    assert rms_px(refine_subpix(photograph.image, start), photograph) < 0.15


def test_sixteen_bits_are_used() -> None:
    photograph = Photograph.of(BOARD)
    deep = Image("deep", photograph.image.pixels.astype(np.uint16) * 257)
    start = near(photograph)
    assert np.allclose(refine_subpix(deep, start).pixels, refine_subpix(photograph.image, start).pixels, atol=2e-3)


@pytest.mark.parametrize("shape", [(1, 1), (9, 200), (20, 20)])
@pytest.mark.parametrize("corners", [0, 1, 3])
def test_small_images_and_few_corners(shape: tuple[int, int], corners: int) -> None:
    image = Image("small", np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8))
    pixels = np.random.default_rng(1).uniform(0, 1, (corners, 2)) * (np.array(shape[::-1]) - 1)
    refined = refine_subpix(image, Detection(np.arange(corners), pixels))
    assert len(refined) == corners
    assert refined.covariance is None
