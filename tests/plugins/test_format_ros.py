"""ROS camera_info: OpenCV's projection with K and D as the file has them, on what is published of the sensor."""

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
import yaml
from format_truth import agree, directions, opencv, opencv_fisheye
from opencsp_calib_formats.ros import RosCameraInfo, RosIni

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact, fitted
from opencsp_calib.interfaces import Imported
from opencsp_calib.models import LENS_MODELS

INTRINSICS = [900.5, 901.5, 502.0, 398.5]
D = [-0.1, 0.02, 0.001, -0.002, -0.003]
INFO = """image_width: 1000
image_height: 800
camera_name: 0815_left
camera_matrix:
  rows: 3
  cols: 3
  data: [900.5, 0, 502, 0, 901.5, 3985e-1, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [-1e-1, 0.02, 1E-3, -0.002, -0.003]}
rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}
projection_matrix: {rows: 3, cols: 4, data: [800, 0, 500, -80, 0, 800, 400, 0, 0, 0, 1, 0]}
"""
MESSAGE = """header:
  seq: 7
  frame_id: left_optical
height: 800
width: 1000
distortion_model: "plumb_bob"
D: [-0.1, 0.02, 0.001, -0.002, -0.003]
K: [900.5, 0.0, 502.0, 0.0, 901.5, 398.5, 0.0, 0.0, 1.0]
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [800.0, 0.0, 500.0, 0.0, 0.0, 800.0, 400.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi: {x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: False}
---
"""
INI = """# oST version 5.0 parameters
[image]

width
1000

height
800

[stereo/left]

camera matrix
900.500000 0.000000 502.000000
0.000000 901.500000 398.500000
0.000000 0.000000 1.000000

distortion
-0.1 0.02 0.001 -0.002 -0.003 0.0 0.0 0.0

rectification
1 0 0
0 1 0
0 0 1

projection
800 0 500 0
0 800 400 0
0 0 1 0
"""


def read(path: Path, text: str) -> Mapping[str, Imported]:
    format_ = RosIni() if path.suffix == ".ini" else RosCameraInfo()
    path.write_text(text)
    assert format_.recognises(path)
    return format_.read(path)


@pytest.mark.parametrize(
    ("name", "text", "key"),
    [
        ("a.yaml", INFO, "0815_left"),
        ("a.yaml", INFO.replace("distortion_model: plumb_bob\n", ""), "0815_left"),
        ("b.yaml", MESSAGE, "left_optical"),
        ("b.yaml", MESSAGE * 3, "left_optical"),
        ("b.yaml", re.sub("^[DKRP]:", lambda key: key[0].lower(), MESSAGE, flags=re.MULTILINE), "left_optical"),
        ("c.ini", INI, "left"),
    ],
)
def test_k_and_d_not_p(name: str, text: str, key: str, tmp_path: Path) -> None:
    ((found, imported),) = read(tmp_path / name, text).items()
    camera = exact(imported)
    assert found == camera.name == key
    assert camera.image_size == (1000, 800)
    agree(camera.project(directions()), opencv(directions(), INTRINSICS, D))


def test_equidistant(tmp_path: Path) -> None:
    text = INFO.replace("plumb_bob", "equidistant").replace("cols: 5", "cols: 4").replace(", -0.003]", "]")
    camera = exact(read(tmp_path / "a.yaml", text)["0815_left"])
    agree(camera.project(directions()), opencv_fisheye(directions(), INTRINSICS, D[:4]))
    vendors = read(tmp_path / "a.yaml", text.replace("equidistant", "fisheye"))["0815_left"]
    assert np.array_equal(exact(vendors).params, camera.params)
    assert [note.code for note in vendors.notes] == ["unverified-convention"]


@pytest.mark.parametrize("binning", [(2, 2), (4, 2)])
def test_binning_and_region_are_applied(binning: tuple[int, int], tmp_path: Path) -> None:
    """A pixel that stands for b pixels of the sensor is where the mean of their centres is."""
    roi = "roi: {x_offset: 100, y_offset: 40, height: 600, width: 800, do_rectify: False}"
    text = MESSAGE.replace("roi: {x_offset: 0, y_offset: 0, height: 0, width: 0, do_rectify: False}", roi)
    text = text.replace("binning_x: 0", f"binning_x: {binning[0]}").replace("binning_y: 0", f"binning_y: {binning[1]}")
    imported = read(tmp_path / "a.yaml", text)["left_optical"]
    camera = exact(imported)
    assert camera.image_size == (800 // binning[0], 600 // binning[1])
    sensor = opencv(directions(), INTRINSICS, D)
    published = [
        np.mean([(sensor[:, axis] - offset - k) / b for k in range(b)], axis=0)
        for axis, (offset, b) in enumerate(zip((100, 40), binning, strict=True))
    ]
    agree(camera.project(directions()), np.column_stack(published))
    assert [note.code for note in imported.notes] == ["region-of-interest", "unverified-convention"]
    shift = (binning[0] - 1) / (2 * binning[0])
    assert f"{shift:g} and" in imported.notes[1].message


def test_binning_of_a_camera_that_is_not_exact(tmp_path: Path) -> None:
    text = MESSAGE.replace("binning_x: 0", "binning_x: 2").replace("binning_y: 0", "binning_y: 2")
    imported = read(tmp_path / "a.yaml", text.replace("K: [900.5, 0.0", "K: [900.5, 3.0"))["left_optical"]
    assert imported.image_size == (500, 400)
    with pytest.raises(NotExactError, match="skew = 3 px"):
        exact(imported)
    plain = opencv(directions(), INTRINSICS, D)
    plain[:, 0] += 3.0 * (plain[:, 1] - 398.5) / 901.5
    agree(imported.project(directions()), (plain + 0.5) / 2 - 0.5)
    assert fitted(imported, "opencv5", 5.0).worst_px > 0.1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("[900.5, 0.0, 502", "[0.0, 0.0, 0"), "not calibrated"),
        (("height: 0, width: 0", "height: 700, width: 1100"), "not within"),
        (("x_offset: 0", "x_offset: 5000"), "not within"),
        (("D: [-0.1", "D: [nan"), "not a number"),
        (("0.001, -0.002, -0.003]", "0.001]"), "plumb_bob has 3 coefficients"),
        (('"plumb_bob"', '"none"'), "distortion_model 'none'"),
    ],
)
def test_refused(change: tuple[str, str], message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    path.write_text(MESSAGE.replace(*change))
    with pytest.raises(InputError, match=message):
        exact(next(iter(RosCameraInfo().read(path).values())))


def test_ini_of_four_numbers_does_not_say_of_which_model(tmp_path: Path) -> None:
    cameras = read(tmp_path / "a.ini", INI.replace(" -0.003 0.0 0.0 0.0", ""))
    assert list(cameras) == ["left:opencv4", "left:opencv_fisheye"]


@pytest.mark.parametrize(
    ("model", "theirs", "count"),
    [("pinhole", "plumb_bob", 5), ("opencv4", "plumb_bob", 5), ("opencv5", "plumb_bob", 5),
     ("opencv8", "rational_polynomial", 8), ("opencv_fisheye", "equidistant", 4)],
)  # fmt: skip
def test_written_for_any_yaml_reader(model: str, theirs: str, count: int, tmp_path: Path) -> None:
    """PyYAML, which ROS's Python tools use, takes every number for a number, and bit for bit."""
    names = LENS_MODELS[model].distortion_names
    params = np.array([1000 / 3, 1e3, 502.1, 398.7, *([1e-5 / 3, 1e-300, -2e-7, 0.25] * 2)])[: 4 + len(names)]
    camera = Camera("left: #1", model, params, (1000, 800))
    path = tmp_path / "a.yaml"
    RosCameraInfo().write({"x": camera}, path)
    content = yaml.safe_load(path.read_text())
    assert content["camera_name"] == camera.name
    assert content["distortion_model"] == theirs
    assert np.array_equal(np.reshape(content["camera_matrix"]["data"], (3, 3)), camera.matrix)
    coefficients = content["distortion_coefficients"]["data"]
    assert coefficients == [*camera.distortion, *np.zeros(count - len(camera.distortion))]
    assert np.array_equal(np.reshape(content["projection_matrix"]["data"], (3, 4))[:, :3], camera.matrix)
    again = exact(RosCameraInfo().read(path)[camera.name])
    assert np.array_equal(again.params[: len(params)], params)


def test_written_ini(tmp_path: Path) -> None:
    camera = Camera("left", "opencv8", np.array([*INTRINSICS, *D, 1e-5 / 3, 0, 1e-300]), (1000, 800))
    path = tmp_path / "a.ini"
    RosIni().write({"left": camera}, path)
    assert exact(RosIni().read(path)["left"]) == camera
    with pytest.raises(InputError, match="not opencv_fisheye"):
        RosIni().write({"a": Camera("a", "opencv_fisheye", np.array([*INTRINSICS, 0, 0, 0, 0]), (9, 9))}, path)
    with pytest.raises(InputError, match="holds one camera, not 2"):
        RosIni().write({"a": camera, "b": camera}, path)


def test_real_files(data_dir: Path) -> None:
    folder = data_dir / "formats" / "ros"
    camera = exact(RosCameraInfo().read(folder / "ost.yaml")["narrow_stereo"])
    d = [0.009070, -0.252392, 0.012528, 0.015732, 0.0]
    agree(camera.project(directions(25)), opencv(directions(25), [645.143552, 637.119434, 369.844129, 243.264356], d))
    assert "08144361026320a0" in RosCameraInfo().read(folder / "test_calibration.yaml")
    ini = exact(RosIni().read(folder / "calib8.ini")["mono_left"])
    d = [0.189544, -0.018229, -0.000630, 0.000054, -0.000212, 0.543582, -0.027892, 0.0]
    agree(ini.project(directions(25)), opencv(directions(25), [369.344588, 367.154330, 320.739078, 203.592450], d))


def test_a_number_that_is_no_size(tmp_path: Path) -> None:
    path = tmp_path / "a.ini"
    path.write_text(INI.replace("1000", "x"))
    with pytest.raises(FileFormatError, match="width"):
        RosIni().read(path)
