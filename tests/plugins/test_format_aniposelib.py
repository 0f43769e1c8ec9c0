"""aniposelib, anipose, freemocap: OpenCV's numbers as they are."""

from pathlib import Path

import numpy as np
import pytest
from format_files_robotics import ANIPOSELIB, CALISCOPE
from format_truth import agree, directions, opencv, opencv_fisheye
from opencsp_calib_formats.aniposelib import Aniposelib

from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import exact

K = (900.5, 901.5, 502.0, 398.5)


def read(tmp_path: Path, text: str):
    path = tmp_path / "calibration.toml"
    path.write_text(text)
    assert Aniposelib().recognises(path)
    return Aniposelib().read(path)


def test_real_file(data_dir: Path) -> None:
    cameras = Aniposelib().read(data_dir / "formats" / "aniposelib" / "calibration.toml")
    assert list(cameras) == ["08150951", "08151951", "08152151", "08154551"]
    camera = exact(cameras["08150951"])
    f, k1 = 1067.9225054137046, -0.10246784690944921
    np.testing.assert_array_equal(camera.params, [f, f, 639.5, 511.5, k1, 0, 0, 0, 0])
    assert camera.image_size == (1280, 1024)


def test_opencv(tmp_path: Path) -> None:
    camera = exact(read(tmp_path, ANIPOSELIB.decode())["left"])
    agree(camera.project(directions()), opencv(directions(), K, (-0.1, 0.02, 1e-3, -2e-3, -3e-3)))


def test_fisheye(tmp_path: Path) -> None:
    text = ANIPOSELIB.decode().replace("-0.1, 0.02, 0.001, -0.002, -0.003,", "0.01, -0.02, 0.001, -0.0002,")
    camera = exact(read(tmp_path, text.replace("[metadata]", "fisheye = true\n[metadata]\nerror = 0.1"))["left"])
    agree(camera.project(directions(80)), opencv_fisheye(directions(80), K, (0.01, -0.02, 1e-3, -2e-4)))


def test_one_name_twice(tmp_path: Path) -> None:
    text = ANIPOSELIB.decode()
    assert list(read(tmp_path, text.replace("[metadata]", "") + text.replace("cam_0", "cam_1"))) == ["left", "left (2)"]


def test_caliscope_files_are_not_taken(tmp_path: Path) -> None:
    path = tmp_path / "camera_array.toml"
    path.write_bytes(CALISCOPE)
    assert not Aniposelib().recognises(path)


@pytest.mark.parametrize("change", [("matrix", "matrices"), ("1000, 800,", ""), ("901.5", "nan"), ("502.0", '"a"')])
def test_refused(tmp_path: Path, change: tuple) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, ANIPOSELIB.decode().replace(*change))
