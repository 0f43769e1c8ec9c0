"""A calibration in lines for people."""

import pytest
from camera_files import camera_of

from opencsp_calib.summary import PIXEL_PITCH, parameter_lines


def test_lengths_in_millimetres_are_pixels_times_their_size() -> None:
    camera = camera_of("opencv4")
    lines = {name: value for name, value, _ in parameter_lines(camera, None, {PIXEL_PITCH: "4.5"})}
    number, unit = lines["focal length x"].split()
    assert (float(number), unit) == (pytest.approx(camera.params[0] * 4.5e-3, abs=1e-4), "mm")
    assert "focal length x" not in [name for name, *_ in parameter_lines(camera, None, {})]


@pytest.mark.parametrize("pitch", ["abc", "", "nan", "inf", "-4.5", "0"])
def test_a_size_of_pixels_that_is_none_is_passed_over(pitch: str) -> None:
    """It may be a note that somebody typed, or from anybody's file."""
    camera = camera_of("opencv4")
    assert parameter_lines(camera, None, {PIXEL_PITCH: pitch}) == parameter_lines(camera, None, {})
