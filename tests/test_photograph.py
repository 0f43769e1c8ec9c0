"""The quality of a photograph is what it was rendered with, and what is wrong with it is said."""

from dataclasses import replace

import numpy as np
import pytest
from board_photographs import SIZE, Photograph, small_camera

from opencsp_calib import Checkerboard, Detection, Image, RejectedCorner
from opencsp_calib.corners import refine
from opencsp_calib.photograph import PhotographQuality, measured, problems_of
from opencsp_calib.rendering import Exposure, Scene, Spot

BOARD = Checkerboard(9, 6, 0.05)
PIXEL_PX2 = 1 / 12  # the variance that a pixel's own area adds to all blur


def seen(photograph: Photograph) -> Detection:
    """Refined from the true corners, as a detector would find them to a pixel."""
    near = photograph.pixels + np.random.default_rng(0).normal(0, 0.3, photograph.pixels.shape)
    inside = ((near > 3) & (near < np.array(photograph.image.size) - 4)).all(axis=1)
    ids = np.flatnonzero(inside)
    return refine(photograph.image, Detection(ids, near[ids]), photograph.board)


def quality_of(photograph: Photograph) -> PhotographQuality:
    quality = measured(photograph.image, seen(photograph), photograph.board)
    assert quality is not None
    return quality


def codes(photograph: Photograph) -> set[str]:
    return {problem.code for problem in problems_of(photograph.image, seen(photograph), photograph.board)}


@pytest.mark.parametrize(
    "scene", [Scene(), Scene(shading=(0.3, 0.3)), Scene(white=240.0, black=10.0)], ids=["usual", "lamp", "bright"]
)
@pytest.mark.parametrize("tilt_deg", [0, 45])
def test_nothing_is_wrong_with_a_good_photograph(scene: Scene, tilt_deg: float) -> None:
    assert codes(Photograph.of(BOARD, scene=scene, tilt_deg=tilt_deg)) == set()


@pytest.mark.parametrize("psf_px", [0.3, 0.6, 1.0, 2.0, 3.0])
def test_blur_is_measured(psf_px: float) -> None:
    blur = quality_of(Photograph.of(BOARD, exposure=Exposure(psf_px=psf_px))).blur
    assert blur is not None
    # within 5 %: a sharp edge is sampled at too few places across it to tell its width better from each
    assert np.sqrt(blur.major_px * blur.minor_px) == pytest.approx(np.sqrt(psf_px**2 + PIXEL_PX2), rel=0.05)
    assert blur.major_px < 1.05 * blur.minor_px


@pytest.mark.parametrize("length_px", [3.0, 8.0])
@pytest.mark.parametrize("direction_deg", [0, 30, 45, 90, 160])
@pytest.mark.parametrize("roll_deg", [0, 45])
def test_motion_is_measured_in_any_direction_to_the_edges(
    length_px: float, direction_deg: float, roll_deg: float
) -> None:
    motion = length_px * np.cos(np.radians(direction_deg)), length_px * np.sin(np.radians(direction_deg))
    blur = quality_of(Photograph.of(BOARD, roll_deg=roll_deg, exposure=Exposure(motion_px=motion))).blur
    assert blur is not None
    assert blur.motion_px == pytest.approx(length_px, rel=0.12)
    assert (blur.direction_deg - direction_deg + 90) % 180 - 90 == pytest.approx(0, abs=6)


def test_motion_and_defocus_are_told_apart() -> None:
    moved = Photograph.of(BOARD, exposure=Exposure(motion_px=(5.0, 5.0)))
    problems = problems_of(moved.image, seen(moved), BOARD)
    assert [problem.code for problem in problems] == ["motion-blur"]
    assert "upper left to lower right" in problems[0].message
    assert codes(Photograph.of(BOARD, exposure=Exposure(defocus_px=7.0))) == {"out-of-focus"}
    assert codes(Photograph.of(BOARD, exposure=Exposure(psf_px=1.5))) == set()


def test_light() -> None:
    light = quality_of(Photograph.of(BOARD, scene=Scene(white=200.0, black=40.0, shading=(0, 0)))).light
    assert light is not None
    assert light.contrast == pytest.approx(160 / 255, rel=0.1)
    assert light.clipped == 0
    assert light.glare == 0
    assert light.glare_at is None
    assert light.evenness > 0.8


def test_low_contrast() -> None:
    assert codes(Photograph.of(BOARD, scene=Scene(white=90.0, black=50.0))) == {"low-contrast"}
    assert codes(Photograph.of(BOARD, exposure=Exposure(gain=0.2))) == {"low-contrast"}


def test_clipped_white() -> None:
    assert "clipped" in codes(Photograph.of(BOARD, exposure=Exposure(gain=1.6)))


def test_a_camera_whose_white_is_not_the_largest_number() -> None:
    photograph = Photograph.of(BOARD, exposure=Exposure(bits=16, gain=1.6))
    twelve = Image("12 bits in 16", photograph.image.pixels // 16, white=4095)
    assert "clipped" in codes(replace(photograph, image=twelve))


def test_a_reflection_is_found_where_it_is() -> None:
    plain = Photograph.of(BOARD)
    x, y = plain.pixels[2 * 9 + 4]
    photograph = Photograph.of(BOARD, scene=Scene(glare=(Spot(float(x), float(y), 45.0, 220.0),)))
    light = quality_of(photograph).light
    assert light is not None
    assert light.glare_at is not None
    assert np.hypot(light.glare_at[0] - x, light.glare_at[1] - y) < 90
    assert "glare" in codes(photograph)


def test_a_shadow_across_the_board() -> None:
    photograph = Photograph.of(BOARD)
    _, x = np.indices(photograph.image.pixels.shape)
    for deep, said in ((0.4, True), (0.85, False)):
        dark = np.where(x > SIZE[0] / 2, deep, 1.0) * photograph.image.pixels
        shadowed = replace(photograph, image=Image("shadow", dark.astype(np.uint8)))
        assert ("shadow" in codes(shadowed)) is said


def test_small_squares() -> None:
    assert "squares-too-small" in codes(Photograph.of(BOARD, fill=0.1))
    assert "squares-too-small" not in codes(Photograph.of(BOARD, fill=0.25))


def test_squares_that_are_small_for_their_blur() -> None:
    board = Checkerboard(24, 18, 0.05)
    assert "squares-too-small" not in codes(Photograph.of(board, fill=0.8, tilt_deg=5))
    assert "squares-too-small" in codes(Photograph.of(board, fill=0.8, tilt_deg=5, exposure=Exposure(psf_px=4.0)))


def test_a_board_that_touches_the_border() -> None:
    touching = Photograph.of(BOARD, fill=0.95, roll_deg=0, tilt_deg=0, shift=(0.0, 0.16))
    quality = quality_of(touching)
    to_border = np.minimum(touching.pixels, np.array(SIZE) - 1 - touching.pixels).min(axis=1)
    inside = touching.pixels[:, 1] < SIZE[1] - 4
    close = np.sum(inside & (to_border < quality.square_px / 2))
    assert close > 4
    assert quality.at_border == pytest.approx(close, abs=2)
    assert codes(touching) == {"at-border"}
    assert quality_of(Photograph.of(BOARD, fill=0.7)).at_border == 0


def test_corners_that_were_rejected_are_counted_with_the_reason() -> None:
    photograph = Photograph.of(BOARD)
    detection = seen(photograph)
    gone = tuple(RejectedCorner(i, tuple(photograph.pixels[i]), "occluded") for i in range(8))
    partial = replace(detection.keeping(detection.ids >= 8), rejected=gone)
    quality = measured(photograph.image, partial, BOARD)
    assert quality is not None
    assert quality.rejected == pytest.approx(8 / 54)
    assert quality.rejected_for == "occluded"
    problems = problems_of(photograph.image, partial, BOARD)
    assert [p.code for p in problems] == ["corners-rejected"]
    assert "occluded" in problems[0].message


def test_a_detection_that_was_not_fitted_can_be_judged() -> None:
    photograph = Photograph.of(BOARD, exposure=Exposure(psf_px=3.0))
    plain = Detection(np.arange(54), photograph.pixels)
    assert {problem.code for problem in problems_of(photograph.image, plain, BOARD)} == {"out-of-focus"}


@pytest.mark.parametrize("ids", [[], [0], [0, 1, 2, 3], [0, 1, 9, 10], list(range(20))])
def test_few_corners_never_make_it_fail(ids: list[int]) -> None:
    photograph = Photograph.of(BOARD)
    for image in (photograph.image, Image("black", np.zeros_like(photograph.image.pixels))):
        problems_of(image, Detection(ids, photograph.pixels[ids].reshape(-1, 2)), BOARD)


def test_corners_outside_the_image_are_said_to_be_at_its_border() -> None:
    photograph = Photograph.of(BOARD, camera=small_camera())
    outside = Detection(np.arange(54), photograph.pixels + np.array([600.0, -500.0]))
    assert [problem.code for problem in problems_of(photograph.image, outside, BOARD)] == ["at-border"]


def test_corners_that_a_poor_detector_put_in_one_place_never_make_it_fail() -> None:
    photograph = Photograph.of(BOARD)
    pixels = photograph.pixels.copy()
    pixels[20] = pixels[21]
    assert measured(photograph.image, Detection(np.arange(len(pixels)), pixels), BOARD) is not None
