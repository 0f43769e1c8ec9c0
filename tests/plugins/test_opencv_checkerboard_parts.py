"""Checkerboards of which only a part is seen: what can be told is right, and the rest has a reason."""

import numpy as np
import pytest
from board_photographs import NEAR_PX, SIZE, Photograph, detected
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from opencsp_calib_opencv.checkerboard import CheckerboardDetector

from opencsp_calib import Checkerboard, Detection, Image
from opencsp_calib.corners import refine
from opencsp_calib.errors import InputError
from opencsp_calib.rendering import Exposure, Scene, Spot

BOARD = Checkerboard(9, 6, 0.05)
SANDIA = Checkerboard(18, 23, 0.05)
PLAIN = Scene(clutter=0.0)


def find(image: Image, board: Checkerboard = BOARD) -> Detection:
    return detected(CheckerboardDetector(), image, board)


@pytest.mark.parametrize("shift", [(0.45, 0.0), (-0.45, 0.05), (0.0, 0.45), (0.05, -0.4)])
def test_a_board_partly_out_of_view_gives_the_corners_that_can_be_told(shift: tuple[float, float]) -> None:
    photograph = Photograph.of(BOARD, tilt_deg=15, roll_deg=0, fill=0.85, shift=shift, scene=PLAIN)
    detection = find(photograph.image)
    inside = ((photograph.pixels > 10) & (photograph.pixels < np.array(SIZE) - 10)).all(axis=1).sum()
    assert 0.8 * inside <= len(detection) < 54
    assert photograph.farthest_px(detection) < NEAR_PX
    assert "out of view" in detection.reason


def test_a_corner_of_a_board_could_be_any_of_two_and_is_refused() -> None:
    photograph = Photograph.of(BOARD, tilt_deg=10, roll_deg=0, fill=0.9, shift=(0.4, 0.35), scene=PLAIN)
    detection = find(photograph.image)
    assert len(detection) == 0
    assert "which ones cannot be told" in detection.reason


def test_the_middle_of_a_board_is_refused() -> None:
    whole = Photograph.of(SANDIA, fill=0.95, tilt_deg=10).image
    middle = Image("middle", np.ascontiguousarray(whole.pixels[150:450, 250:550]))
    detection = find(middle, SANDIA)
    assert len(detection) == 0
    assert "which ones cannot be told" in detection.reason


def test_what_is_covered_is_left_out_and_the_rest_keeps_its_ids() -> None:
    photograph = Photograph.of(BOARD, tilt_deg=10)
    x, y = photograph.pixels[4 * 9 + 4]
    covered = Photograph.of(BOARD, tilt_deg=10, scene=Scene(occluders=(Spot(float(x), float(y), 45.0, 120.0),)))
    detection = find(covered.image)
    assert 40 <= len(detection) < 54
    assert 4 * 9 + 4 not in detection.ids
    assert covered.farthest_px(detection) < NEAR_PX


UNIT = st.floats(0, 1)
AT_EDGE_PX = 6.0  # about as far as a corner's surroundings reach


@settings(max_examples=30)
@given(
    grid=st.tuples(st.integers(3, 14), st.integers(3, 14)),
    angles=st.tuples(st.floats(0, 55), st.floats(0, 360), st.floats(-180, 180)),
    place=st.tuples(UNIT, UNIT),
    shift=st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4)),
    spot=st.tuples(UNIT, UNIT, st.floats(1, 120), st.floats(0, 255)),
    psf_px=st.floats(0.3, 1.5),
    noise=st.floats(0, 6),
)
def test_accepted_corners_are_where_they_should_be(
    grid: tuple[int, int],
    angles: tuple[float, float, float],
    place: tuple[float, float],
    shift: tuple[float, float],
    spot: tuple[float, float, float, float],
    psf_px: float,
    noise: float,
) -> None:
    board = Checkerboard(*grid, 0.03)
    scene = Scene(occluders=(Spot(spot[0] * SIZE[0], spot[1] * SIZE[1], *spot[2:]),))
    tilt_deg, azimuth_deg, roll_deg = angles
    try:
        photograph = Photograph.of(
            board, tilt_deg=tilt_deg, azimuth_deg=azimuth_deg, roll_deg=roll_deg, position=place, shift=shift,
            scene=scene, exposure=Exposure(psf_px=psf_px, noise=noise),
        )  # fmt: skip
    except InputError:
        assume(False)
    assume(np.isfinite(photograph.pixels).all())
    detection = find(photograph.image, board)
    from_cover = np.abs(np.linalg.norm(detection.pixels - np.multiply(spot[:2], SIZE), axis=1) - spot[2])
    # corners half covered may be drawn to the cover's edge; the fit that follows looks at them more closely
    assert photograph.off_px(detection)[from_cover > AT_EDGE_PX].max(initial=0) < NEAR_PX
    assert photograph.off_px(refine(photograph.image, detection, board)).max(initial=0) < 0.5
