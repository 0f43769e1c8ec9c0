"""The plugin keeps what it promises."""

from opencsp_calib_circles.board import CircleGrid, CircleGridKind
from opencsp_calib_circles.detector import CircleGridDetector
from opencsp_calib_circles.open3d import Open3D

from opencsp_calib import Camera
from opencsp_calib.conformance import parametrize_checks


@parametrize_checks(CircleGridKind(), specs=("circles:11x7:30mm:14mm", "circles:5x8:2in:1in"))
def test_the_board(provided, check):
    check(provided)


@parametrize_checks(CircleGridDetector(), boards=(CircleGrid(7, 5, 0.03, diameter_m=0.014),))
def test_the_detector(provided, check):
    check(provided)


@parametrize_checks(Open3D())
def test_the_format(provided, check):
    check(provided)


def test_a_file_that_open3d_wrote(tmp_path):
    path = tmp_path / "primesense.json"
    path.write_text('{ "height": 480, "intrinsic_matrix": [525.0, 0, 0, 0, 524.0, 0, 319.5, 239.5, 1], "width": 640 }')
    expected = Camera("primesense", "pinhole", [525.0, 524.0, 319.5, 239.5], (640, 480))
    assert Open3D().read(path)["primesense"].camera == expected
