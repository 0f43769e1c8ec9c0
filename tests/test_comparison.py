"""Cameras are compared by projection, after the frame change that fits best."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from opencsp_calib.camera import Camera
from opencsp_calib.comparison import Difference, _rotation_between, compare, frame_jacobian, pixel_grid
from opencsp_calib.errors import InputError

SIZE = (1626, 1236)
PARAMS = np.array([2710.0, 2704.0, 853.7, 628.0, -0.05, 0.1, 1e-4, -2e-4])
CAMERA = Camera("a", "opencv4", PARAMS, SIZE)
FISHEYE = Camera("fisheye", "opencv_fisheye", np.array([700.0, 705, 812, 617, 0.01, -0.003, 0, 0]), SIZE)


def changed(camera: Camera, **change: float) -> Camera:
    params = camera.params.copy()
    for name, value in change.items():
        params[camera.lens.parameter_names.index(name)] += value
    return replace(camera, params=params)


@pytest.mark.parametrize("range_m", [None, 0.3, 20.0])
@pytest.mark.parametrize("camera", [CAMERA, FISHEYE], ids=["opencv4", "fisheye"])
def test_a_camera_does_not_differ_from_itself(camera: Camera, range_m: float | None) -> None:
    difference = compare(camera, camera, range_m=range_m)
    assert difference.worst_px < 1e-8
    assert difference.rotation_deg < 1e-9
    assert np.abs(difference.translation).max() < 1e-9
    assert difference.missing == 0
    assert difference.range_m == range_m


def test_a_moved_principal_point_is_a_turn_of_the_frame_to_second_order() -> None:
    """Shifting cx by d is a turn by d/fx but for terms in (x/z)² d, which shrink with d and with the field of view."""
    d = 3.0
    difference = compare(CAMERA, changed(CAMERA, cx=d))
    assert difference.rotation_deg == pytest.approx(np.degrees(d / 2710), rel=0.05)
    half_width = 0.3  # tan of half the field of view
    assert 0 < difference.rms_px < d * half_width**2 / 2
    narrow = Camera("narrow", "pinhole", np.array([54200.0, 54200.0, 812.5, 617.5]), SIZE)
    assert compare(narrow, changed(narrow, cx=d)).worst_px < d * (812.5**2 + 617.5**2) / 54200**2


@pytest.mark.parametrize("range_m", [None, 2.0])
def test_is_the_minimum_that_brute_force_finds_with_opencv(range_m: float | None) -> None:
    other = changed(CAMERA, fx=8.0, fy=5.0, cx=-9.0, cy=4.0, k1=0.01, p2=3e-4)
    difference = compare(CAMERA, other, range_m=range_m, grid=(12, 9))
    pixels = difference.pixels.reshape(-1, 1, 2)
    rays = CAMERA.unproject(pixels[:, 0]) * (range_m or 1.0)
    back, _ = cv2.projectPoints(rays, np.zeros(3), np.zeros(3), CAMERA.matrix, CAMERA.distortion)
    assert back == pytest.approx(pixels, abs=1e-8)

    def residuals(frame: np.ndarray) -> np.ndarray:
        shift = frame[3:] if range_m else np.zeros(3)
        seen, _ = cv2.projectPoints(rays, frame[:3], shift, other.matrix, other.distortion)
        return (seen - pixels).ravel()

    found = least_squares(residuals, np.zeros(6 if range_m else 3), x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert difference.rms_px == pytest.approx(np.sqrt(2 * found.cost / len(rays)), rel=1e-8)
    assert difference.shift.ravel() == pytest.approx(residuals(found.x), abs=1e-5)
    assert difference.rotation == pytest.approx(Rotation.from_rotvec(found.x[:3]).as_matrix(), abs=1e-8)
    if range_m:
        assert difference.translation == pytest.approx(found.x[3:], abs=1e-7)
    else:
        assert not difference.translation.any()


@pytest.mark.parametrize("range_m", [None, 2.0])
def test_hardly_matters_which_camera_comes_first(range_m: float | None) -> None:
    other = changed(CAMERA, fx=5.0, cx=-9.0, cy=4.0, k1=0.01)
    there, back = compare(CAMERA, other, range_m=range_m), compare(other, CAMERA, range_m=range_m)
    assert there.rms_px == pytest.approx(back.rms_px, rel=0.02)
    assert there.worst_px == pytest.approx(back.worst_px, rel=0.05)
    assert there.rotation @ back.rotation == pytest.approx(np.eye(3), abs=5e-4)


@settings(max_examples=15)
@given(
    turn=st.tuples(*[st.floats(-0.05, 0.05)] * 3),
    shift=st.tuples(*[st.floats(-0.05, 0.05)] * 3),
)
def test_the_jacobian_of_the_frame_is_the_derivative_by_a_turn_and_a_shift(turn: tuple, shift: tuple) -> None:
    """In any direction, by differences."""
    rays = FISHEYE.unproject(pixel_grid(SIZE, (5, 4)).reshape(-1, 2)) * 2.0
    _, by_point, _ = FISHEYE.lens.project_with_jacobians(rays, FISHEYE.params)
    predicted = frame_jacobian(by_point, rays, shifted=True) @ np.array([*turn, *shift])
    h = 1e-5

    def seen(sign: float) -> np.ndarray:
        rotation = Rotation.from_rotvec(sign * h * np.array(turn))
        return FISHEYE.project(rotation.apply(rays) + sign * h * np.array(shift))

    assert predicted == pytest.approx((seen(1) - seen(-1)) / (2 * h), abs=1e-4)


def test_pixels_without_an_image_are_counted_and_left_out() -> None:
    folded = Camera("folded", "opencv4", np.array([900.0, 900, 812.5, 617.5, -0.4, 0.0, 0.0, 0.0]), SIZE)
    assert np.isnan(folded.unproject(np.array([[0.0, 0.0]]))).all()  # the corners are beyond the fold
    other = changed(folded, cx=1.0)
    for a, b in ((folded, other), (other, folded), (folded, changed(folded, k1=0.02))):
        for range_m in (None, 3.0):
            difference = compare(a, b, range_m=range_m)
            assert 0 < difference.missing < 800
            assert np.isfinite([difference.rms_px, difference.median_px, difference.worst_px]).all()
            assert np.isnan(difference.shift[0, 0]).all()
            assert difference.rms_px < 30


def test_is_the_minimum_of_the_pixels_that_have_an_image() -> None:
    """Though a frame that is tried may hide others."""
    folded = Camera("folded", "opencv4", np.array([900.0, 900, 812.5, 617.5, -0.4, 0.0, 0.0, 0.0]), SIZE)
    other = changed(folded, cx=30.0, cy=-10.0)
    difference = compare(folded, other)
    known = np.isfinite(difference.length_px)
    rays, pixels = folded.unproject(difference.pixels[known]), difference.pixels[known]

    def residuals(turn: np.ndarray) -> np.ndarray:
        return (cv2.projectPoints(rays, turn, np.zeros(3), other.matrix, other.distortion)[0][:, 0] - pixels).ravel()

    found = least_squares(residuals, np.zeros(3), x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15)
    assert difference.missing > 0
    assert difference.rms_px == pytest.approx(np.sqrt(2 * found.cost / len(rays)), rel=1e-8)


def test_different_lens_models_of_one_lens_do_not_differ() -> None:
    more = replace(CAMERA, model="opencv8", params=np.concatenate([PARAMS, np.zeros(4)]))
    assert compare(CAMERA, more).worst_px < 1e-8
    assert compare(more, CAMERA, range_m=5.0).worst_px < 1e-8


def test_what_a_translation_can_explain_is_not_a_difference_at_that_range() -> None:
    other = changed(CAMERA, fx=8.0, fy=8.0)
    assert compare(CAMERA, other, range_m=2.0).rms_px < 0.1 * compare(CAMERA, other).rms_px


def test_finite_ranges_differ_by_nothing_but_the_translation() -> None:
    other = changed(CAMERA, fx=8.0, cx=3.0, k1=0.01)
    near, far = compare(CAMERA, other, range_m=1.0), compare(CAMERA, other, range_m=50.0)
    assert near.shift == pytest.approx(far.shift, abs=1e-6)
    assert near.translation * 50 == pytest.approx(far.translation, rel=1e-4)


@pytest.mark.parametrize("range_m", [0.0, -1.0, np.nan, np.inf])
def test_an_impossible_range_is_refused(range_m: float) -> None:
    with pytest.raises(
        InputError, match=f"^the range to compare at must be a positive number of metres, not {range_m}$"
    ):
        compare(CAMERA, CAMERA, range_m=range_m)


def test_images_of_different_sizes_are_refused() -> None:
    said = "^cameras with images of different sizes cannot be compared by pixels: 1626x1236 and 813x618$"
    with pytest.raises(InputError, match=said):
        compare(CAMERA, CAMERA.binned(2))


def test_a_grid_of_one_pixel_is_refused() -> None:
    with pytest.raises(InputError, match=r"^a grid over the image needs at least 2 columns and 2 rows, not 1x5$"):
        compare(CAMERA, CAMERA, grid=(1, 5))
    assert compare(CAMERA, CAMERA, grid=(2, 2)).shift.shape == (2, 2, 2)


def test_cameras_that_see_hardly_anything_are_refused() -> None:
    blind = Camera("blind", "opencv4", np.array([900.0, 900, 812.5, 617.5, -1e8, 0.0, 0.0, 0.0]), SIZE)
    with pytest.raises(
        InputError, match=r"^the cameras cannot be compared: hardly any pixel has a direction in both of"
    ):
        compare(CAMERA, blind)


def test_the_grid_reaches_from_corner_to_corner() -> None:
    pixels = compare(CAMERA, CAMERA).pixels
    assert pixels.shape == (30, 40, 2)
    for corner, expected in (((0, 0), (0, 0)), ((0, -1), (1625, 0)), ((-1, 0), (0, 1235)), ((-1, -1), (1625, 1235))):
        assert tuple(pixels[corner]) == expected
    assert np.ptp(np.diff(pixels[0, :, 0])) < 1e-9


def test_its_figures_are_those_of_the_lengths_that_are_known() -> None:
    shift = np.array([[[3.0, 4.0], [0.0, 1.0]], [[0.0, 2.0], [np.nan, 1.0]]])
    difference = Difference(
        np.zeros((2, 2, 2)), shift, Rotation.from_rotvec([0, 0.1, 0]).as_matrix(), np.zeros(3), None
    )
    np.testing.assert_allclose(difference.length_px, [[5.0, 1.0], [2.0, np.nan]])
    assert difference.missing == 1
    assert difference.rms_px == pytest.approx(np.sqrt(30.0 / 3.0))
    assert (difference.median_px, difference.worst_px) == (2.0, 5.0)
    assert difference.rotation_deg == pytest.approx(np.degrees(0.1))


def test_its_arrays_are_copies_that_nobody_can_change() -> None:
    given = {
        "pixels": np.ones((3, 2, 2)),
        "shift": np.ones((3, 2, 2)),
        "rotation": np.eye(3),
        "translation": np.ones(3),
    }
    difference = Difference(**given, range_m=1.0)
    for name, array in given.items():
        kept = getattr(difference, name)
        before = kept.copy()
        array += 1.0
        assert np.array_equal(kept, before), name
        assert not kept.flags.writeable, name
        with pytest.raises(InputError, match=f"^{name} has shape"):
            replace(difference, **{name: np.zeros((3, 5))})
        if name != "shift":
            with pytest.raises(InputError, match=f"^{name} "):
                replace(difference, **{name: np.full_like(array, np.nan)})


def test_a_large_turn_of_the_frame_is_found() -> None:
    """By the least squares start: a fisheye that is turned by 20 degrees sees half of the same things."""
    turned = Rotation.from_rotvec([0.1, -0.3, 0.2])
    rays = FISHEYE.unproject(pixel_grid(SIZE, (9, 7)).reshape(-1, 2))
    assert _rotation_between(rays, turned.apply(rays)) == pytest.approx(turned.as_matrix(), abs=1e-12)
    some = turned.apply(rays)
    some[::2] = np.nan
    assert _rotation_between(rays, some) == pytest.approx(turned.as_matrix(), abs=1e-12)
