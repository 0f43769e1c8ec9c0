"""Caliscope: OpenCV's numbers as they are."""

from pathlib import Path

import numpy as np
import pytest
from format_files_robotics import ANIPOSELIB, CALISCOPE
from format_truth import agree, directions, opencv, opencv_fisheye
from opencsp_calib_formats.caliscope import Caliscope

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

K, D = (900.5, 901.5, 502.0, 398.5), (-0.1, 0.02, 1e-3, -2e-3, -3e-3)


def read(tmp_path: Path, text: str):
    path = tmp_path / "camera_array.toml"
    path.write_text(text)
    assert Caliscope().recognises(path)
    return Caliscope().read(path)


def test_real_file(data_dir: Path) -> None:
    cameras = Caliscope().read(data_dir / "formats" / "caliscope" / "4_cam_recording_camera_array.toml")
    assert list(cameras) == ["0", "1", "2", "3"]
    camera = exact(cameras["0"])
    expected = [894.5288733178912, 896.877811780321, 624.011791468827, 361.28189843593503]
    expected += [-0.3383569013465177, 0.09672714756989992, -0.0013512226751077358, 0.003155760325647937]
    np.testing.assert_array_equal(camera.params, [*expected, -0.0037489346582201062])
    assert camera.image_size == (1280, 720)


def test_today_and_before(tmp_path: Path) -> None:
    today = exact(read(tmp_path, CALISCOPE.decode())["3"])
    agree(today.project(directions()), opencv(directions(), K, D))
    before = CALISCOPE.decode().replace("[cameras.3]", "[cam_3]").replace("cam_id", "port")
    assert exact(read(tmp_path, before)["3"]) == today


def test_fisheye_flag(tmp_path: Path) -> None:
    text = CALISCOPE.decode().replace("-0.1, 0.02, 0.001, -0.002, -0.003", "0.01, -0.02, 0.001, -0.0002")
    camera = exact(read(tmp_path, text + "fisheye = true\n")["3"])
    agree(camera.project(directions(80)), opencv_fisheye(directions(80), K, (0.01, -0.02, 1e-3, -2e-4)))
    assert exact(read(tmp_path, text + "fisheye = false\n")["3"]).model == "opencv4"


def test_cameras_without_a_matrix_are_left_out_and_none_is_an_error(tmp_path: Path) -> None:
    bare = "[cameras.9]\ncam_id = 9\nsize = [1000, 800]\n"
    assert list(read(tmp_path, bare + CALISCOPE.decode())) == ["3"]
    with pytest.raises(FileFormatError, match="calibrated"):
        read(tmp_path, bare)


def test_skew_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NotExactError, match="skew"):
        exact(read(tmp_path, CALISCOPE.decode().replace("[900.5, 0.0,", "[900.5, 1.0,"))["3"])


def test_anipose_files_are_not_taken(tmp_path: Path) -> None:
    path = tmp_path / "calibration.toml"
    path.write_bytes(ANIPOSELIB)
    assert not Caliscope().recognises(path)


@pytest.mark.parametrize("change", [("1000, 800", "1000"), ("900.5", "-900.5"), ("[0.0, 0.0, 1.0]", "[0.0, 0.0, 2.0]")])
def test_refused(tmp_path: Path, change: tuple) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, CALISCOPE.decode().replace(*change))
