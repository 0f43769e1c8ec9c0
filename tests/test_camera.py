"""The camera: its checks, and binning, subsampling and cropping against averaged pixels."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from opencsp_calib import Camera, InputError, Pose
from opencsp_calib.undistortion import undistort

CAMERA = Camera("lab", "opencv4", [1400.0, 1410.0, 803.0, 611.0, -0.2, 0.1, 1e-3, -2e-3], (1626, 1236))
RAYS = CAMERA.unproject(np.random.default_rng(0).uniform(0, 1200, (50, 2)))


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_binning_averages_the_pixel_coordinates(n: int) -> None:
    # pixel i of the binned image is the mean of pixels n i .. n i + n - 1, whose centre is n i + (n - 1) / 2
    np.testing.assert_allclose(CAMERA.binned(n).project(RAYS) * n + (n - 1) / 2, CAMERA.project(RAYS), atol=1e-9)


@pytest.mark.parametrize("n", [1, 2, 5])
def test_subsampling_keeps_pixel_zero(n: int) -> None:
    np.testing.assert_allclose(CAMERA.subsampled(n).project(RAYS) * n, CAMERA.project(RAYS), atol=1e-9)


def test_cropping_subtracts_the_offset() -> None:
    cropped = CAMERA.cropped(100, 50, 640, 480)
    assert cropped.image_size == (640, 480)
    np.testing.assert_allclose(cropped.project(RAYS) + np.array([100, 50]), CAMERA.project(RAYS), atol=1e-9)
    np.testing.assert_array_equal(cropped.distortion, CAMERA.distortion)


@pytest.mark.parametrize("region", [(-1, 0, 10, 10), (0, 0, 1627, 10), (1600, 0, 27, 10), (0, 0, 0, 10)])
def test_a_region_outside_is_refused(region: tuple[int, int, int, int]) -> None:
    with pytest.raises(InputError, match="not within the 1626x1236 image"):
        CAMERA.cropped(*region)


@pytest.mark.parametrize("n", [0, -2, 1.5])
def test_only_whole_numbers_reduce(n: float) -> None:
    with pytest.raises(InputError, match="whole number"):
        CAMERA.binned(n)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"params": [1, 2, 3]}, r"params has shape \(3,\), expected \(8,\)"),
        ({"params": [np.nan] * 8}, "NaN or infinity in 8 of 8 values"),
        ({"params": [-1, 1, 0, 0, 0, 0, 0, 0]}, "focal lengths must be positive"),
        ({"params": ["a"] * 8}, "not an array of numbers"),
        ({"image_size": (0, 10)}, "positive whole numbers"),
        ({"image_size": (10.5, 10)}, "positive whole numbers"),
        ({"image_size": 10}, "width and height"),
        ({"image_size": (10, 10, 10)}, "width and height"),
    ],
)
def test_impossible_cameras_are_refused(change: dict, message: str) -> None:
    with pytest.raises(InputError, match=message):
        dataclasses.replace(CAMERA, **change)


def test_values_are_frozen() -> None:
    with pytest.raises(ValueError, match="read-only"):
        CAMERA.params[0] = 1.0
    with pytest.raises(dataclasses.FrozenInstanceError):
        CAMERA.name = "other"  # type: ignore[misc]


def test_field_of_view_of_a_pinhole_is_trigonometry() -> None:
    camera = Camera("p", "pinhole", [500.0, 500.0, 499.5, 499.5], (1000, 1000))
    np.testing.assert_allclose(camera.field_of_view[:2], np.pi / 2, atol=1e-12)
    assert camera.field_of_view[2] == pytest.approx(2 * np.arctan(np.sqrt(2)))


def test_field_of_view_of_a_fisheye_may_be_more_than_half_of_all_around() -> None:
    """Without distortion the angle to the axis is the distance from the principal point over the focal length."""
    camera = Camera("f", "opencv_fisheye", [250.0, 250.0, 499.5, 399.5, 0, 0, 0, 0], (1000, 800))
    np.testing.assert_allclose(camera.field_of_view, [1000 / 250, 800 / 250, np.hypot(1000, 800) / 250], rtol=1e-9)


def test_undistort_puts_a_distorted_dot_where_a_pinhole_sees_it() -> None:
    camera = Camera("d", "opencv4", [300.0, 300.0, 160.0, 120.0, -0.3, 0.1, 0, 0], (320, 240))
    y, x = np.mgrid[:240, :320]
    ray = np.array([[0.35, 0.25, 1.0]])
    u, v = camera.project(ray)[0]
    dot = (255 * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * 3.0**2))).astype(np.uint8)
    out = undistort(dot, camera).astype(float)
    found = np.array([(out * x).sum(), (out * y).sum()]) / out.sum()
    expected = np.array([300 * 0.35 + 160, 300 * 0.25 + 120])
    np.testing.assert_allclose(found, expected, atol=0.1)
    with pytest.raises(InputError, match="320x240"):
        undistort(dot[:100], camera)


@given(
    rotation=st.lists(st.floats(-3, 3), min_size=3, max_size=3),
    translation=st.lists(st.floats(-9, 9), min_size=3, max_size=3),
)
def test_a_pose_and_its_inverse_cancel(rotation: list[float], translation: list[float]) -> None:
    pose = Pose(np.array(rotation), np.array(translation))
    points = np.random.default_rng(1).normal(size=(5, 3))
    np.testing.assert_allclose(pose.inverse().transform(pose.transform(points)), points, atol=1e-9)
    np.testing.assert_allclose(pose.inverse().after(pose).transform(points), points, atol=1e-9)
    np.testing.assert_allclose(np.linalg.det(pose.matrix), 1.0)


def test_equal_cameras_are_equal() -> None:
    assert dataclasses.replace(CAMERA) == CAMERA
    assert dataclasses.replace(CAMERA, name="b") != CAMERA
    assert CAMERA != "lab"
    assert "fx=1400" in repr(CAMERA)
