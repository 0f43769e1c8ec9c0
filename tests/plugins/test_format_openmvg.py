"""openMVG: OpenCV's formulas behind cereal's layout."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest
from format_files_photogrammetry import OPENMVG
from format_truth import agree, directions, opencv, opencv_fisheye
from opencsp_calib_formats.openmvg import OpenMvg

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

K = (900.5, 900.5, 502.0, 398.5)


def read(tmp_path: Path, content: dict):
    path = tmp_path / "sfm_data.json"
    path.write_text(json.dumps(content))
    assert OpenMvg().recognises(path)
    return OpenMvg().read(path)


def content(kind: str, poses: bool = True, **data: object) -> dict:
    changed = copy.deepcopy(OPENMVG)
    value = changed["intrinsics"][0]["value"]
    value["polymorphic_name"] = kind
    del value["ptr_wrapper"]["data"]["disto_t2"]
    value["ptr_wrapper"]["data"] |= data
    return changed | {"extrinsics": [{"key": 0}] if poses else []}


@pytest.mark.parametrize(
    ("kind", "data", "coefficients"),
    [
        ("pinhole", {}, ()),
        ("pinhole_radial_k1", {"disto_k1": [-0.1]}, (-0.1, 0, 0, 0)),
        ("pinhole_radial_k3", {"disto_k3": [-0.1, 0.02, -3e-3]}, (-0.1, 0.02, 0, 0, -3e-3)),
        ("pinhole_brown_t2", {"disto_t2": [-0.1, 0.02, -3e-3, 1e-3, -2e-3]}, (-0.1, 0.02, 1e-3, -2e-3, -3e-3)),
    ],
)
def test_pinholes(tmp_path: Path, kind: str, data: dict, coefficients: tuple) -> None:
    camera = exact(read(tmp_path, content(kind, **data))["0"])
    agree(camera.project(directions()), opencv(directions(), K, coefficients))
    assert camera.image_size == (1000, 800)


def test_fisheye(tmp_path: Path) -> None:
    k = (0.01, -0.02, 1e-3, -2e-4)
    camera = exact(read(tmp_path, content("fisheye", fisheye=list(k), focal_length=400.0))["0"])
    agree(camera.project(directions(80)), opencv_fisheye(directions(80), (400, 400, *K[2:]), k))


def test_later_cameras_have_the_number_of_the_class_only(tmp_path: Path) -> None:
    two = content("pinhole")
    second = copy.deepcopy(two["intrinsics"][0]) | {"key": 5}
    second["value"] |= {"polymorphic_id": 1}
    del second["value"]["polymorphic_name"]
    two["intrinsics"].append(second)
    assert list(read(tmp_path, two)) == ["0", "5"]
    assert exact(read(tmp_path, two)["5"]).model == "pinhole"


def test_without_poses_it_is_no_result(tmp_path: Path) -> None:
    codes = [note.code for note in read(tmp_path, content("pinhole", poses=False))["0"].notes]
    assert codes == ["unverified-convention", "not-a-result"]
    assert [n.code for n in read(tmp_path, content("pinhole"))["0"].notes] == ["unverified-convention"]


def test_what_is_no_camera_of_ours_is_refused(tmp_path: Path) -> None:
    with pytest.raises(NotExactError, match="spherical"):
        exact(read(tmp_path, content("spherical"))["0"])
    with pytest.raises(NotExactError, match="not calibrated"):
        exact(read(tmp_path, content("pinhole", focal_length=-1.0))["0"])


@pytest.mark.parametrize(
    "wrong",
    [
        content("pinhole_radial_k3", disto_k3=[-0.1, 0.02]),
        content("pinhole_radial_k3"),
        content("pinhole", principal_point=[1.0]),
        content("pinhole", width=0),
        {"sfm_data_version": "0.3", "intrinsics": []},
    ],
)
def test_refused(tmp_path: Path, wrong: dict) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, wrong)


def test_numbers_are_kept_to_the_last_bit(tmp_path: Path) -> None:
    f = 1234.567890123456789
    np.testing.assert_array_equal(exact(read(tmp_path, content("pinhole", focal_length=f))["0"]).params[:2], [f, f])
