"""transforms.json against nerfstudio's documented convention."""

import json
from pathlib import Path

import numpy as np
import pytest
from format_truth import agree, directions, opencv, opencv_fisheye, perspective
from opencsp_calib_formats.transforms_json import TransformsJson

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

W, H = 1000, 800
COMMON = {"fl_x": 900.5, "fl_y": 901.5, "cx": 502.5, "cy": 399.0, "w": W, "h": H}
K = (900.5, 901.5, 502.0, 398.5)  # the centre of the first pixel is (0.5, 0.5) for nerfstudio


def read(tmp_path: Path, content: dict):
    path = tmp_path / "transforms.json"
    path.write_text(json.dumps(content))
    assert TransformsJson().recognises(path)
    return TransformsJson().read(path)


def one(tmp_path: Path, **content: object):
    (imported,) = read(tmp_path, {**COMMON, **content}).values()
    return imported


def test_real_file(data_dir: Path) -> None:
    (fox,) = TransformsJson().read(data_dir / "formats" / "transforms_json" / "instantngp_fox_transforms.json").values()
    camera = exact(fox)
    expected = [1375.52, 1374.49, 554.058, 964.768, 0.0578421, -0.0805099, -0.000980296, 0.00015575]
    np.testing.assert_allclose(camera.params, expected, rtol=1e-12)
    assert camera.image_size == (1080, 1920)


def test_opencv_model(tmp_path: Path) -> None:
    d = {"k1": -0.1, "k2": 0.02, "p1": 1e-3, "p2": -2e-3, "k3": -3e-3, "k4": 0.0}
    camera = exact(one(tmp_path, camera_model="OPENCV", **d))
    agree(camera.project(directions()), opencv(directions(), K, (-0.1, 0.02, 1e-3, -2e-3, -3e-3)))


def test_k4_is_a_term_in_r8_and_not_opencvs(tmp_path: Path) -> None:
    imported = one(tmp_path, k1=-0.1, k4=0.02)
    with pytest.raises(NotExactError, match=r"k4 = 0\.02"):
        exact(imported)
    x, y = perspective(directions())
    r = np.hypot(x, y)
    scale = 1 - 0.1 * r**2 + 0.02 * r**8
    agree(imported.project(directions()), np.column_stack([K[0] * x * scale + K[2], K[1] * y * scale + K[3]]))


@pytest.mark.parametrize("which", [{"camera_model": "OPENCV_FISHEYE"}, {"is_fisheye": True}])
def test_fisheye_and_its_tangential_terms_are_not_looked_at(tmp_path: Path, which: dict) -> None:
    camera = exact(one(tmp_path, k1=0.01, k2=-0.02, k3=1e-3, k4=-2e-4, p1=0.1, p2=0.1, **which))
    agree(camera.project(directions(80)), opencv_fisheye(directions(80), K, (0.01, -0.02, 1e-3, -2e-4)))


@pytest.mark.parametrize(
    "angle", [{"camera_angle_x": 2 * np.arctan(500 / 900)}, {"x_fov": np.degrees(2 * np.arctan(500 / 900))}]
)
def test_focal_length_from_the_field_of_view(tmp_path: Path, angle: dict) -> None:
    (imported,) = read(tmp_path, {**angle, "w": W, "h": H, "frames": []}).values()
    np.testing.assert_allclose(exact(imported).params, [900, 900, 499.5, 399.5])
    (imported,) = read(tmp_path, {**angle, "frames": []}).values()
    with pytest.raises(InputError, match="--image-size"):
        exact(imported)
    np.testing.assert_allclose(exact(imported.resize((W, H))).params, [900, 900, 499.5, 399.5])


def test_one_camera_for_each_different_frame(tmp_path: Path) -> None:
    frames = [{"file_path": name, **COMMON, "fl_x": f} for name, f in (("a", 900), ("b", 900), ("c", 950))]
    cameras = read(tmp_path, {"camera_model": "PINHOLE", "frames": frames})
    assert {name: exact(imported).params[0] for name, imported in cameras.items()} == {"a": 900, "c": 950}
    assert list(read(tmp_path, {**COMMON, "frames": [{"file_path": "a"}, {"file_path": "b"}]})) == ["camera"]


@pytest.mark.parametrize("more", [{"camera_model": "EQUIRECTANGULAR"}, {"ftheta_p0": 0.1}, {"latlong": True}])
def test_other_lenses_are_refused(tmp_path: Path, more: dict) -> None:
    with pytest.raises(NotExactError):
        exact(one(tmp_path, **more))


@pytest.mark.parametrize(
    "more", [{"fl_x": 0}, {"fl_x": -1}, {"w": 1000.5}, {"k1": "a"}, {"frames": 5}, {"frames": [1]}]
)
def test_refused(tmp_path: Path, more: dict) -> None:
    with pytest.raises(FileFormatError):
        one(tmp_path, **more)


def test_no_field_of_view_is_as_wide_as_a_plane(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="degrees"):
        read(tmp_path, {"camera_angle_x": 3.2, "w": W, "h": H, "frames": []})


def test_opencvs_own_k4_is_not_written(tmp_path: Path) -> None:
    camera = Camera("x", "opencv8", np.array([900.0, 900, 500, 400, 0, 0, 0, 0, 0, 0.1, 0, 0]), (W, H))
    with pytest.raises(InputError, match="k4"):
        TransformsJson().write({"x": camera}, tmp_path / "transforms.json")
    assert list(tmp_path.iterdir()) == []


def test_a_fisheye_that_is_said_to_be_perspective_is_neither(tmp_path: Path) -> None:
    path = tmp_path / "transforms.json"
    path.write_text('{"camera_model": "OPENCV", "is_fisheye": true, "fl_x": 500, "cx": 5, "cy": 4, "w": 10, "h": 8}')
    with pytest.raises(FileFormatError, match="contradict"):
        TransformsJson().read(path)
