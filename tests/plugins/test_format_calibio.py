"""calib.io: OpenCV's coefficients by name, fy from the aspect ratio, classes by cereal's numbers."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest
from format_files_robotics import CALIBIO
from format_truth import agree, directions, opencv
from opencsp_calib_formats.calibio import CalibIo

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

ORDER = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4", "tauX", "tauY")


def read(tmp_path: Path, content: dict):
    path = tmp_path / "project.json"
    path.write_text(json.dumps(content))
    assert CalibIo().recognises(path)
    return CalibIo().read(path)


def changed(model: dict | None = None, **parameters: float) -> dict:
    content = copy.deepcopy(CALIBIO)
    camera = content["calibration"]["cameras"][0]["model"]
    camera |= model or {}
    values = camera["ptr_wrapper"]["data"]["parameters"]
    values |= {key: {"val": value, "state": 2} for key, value in parameters.items()}
    return content


def test_layout_example(data_dir: Path) -> None:
    (imported,) = CalibIo().read(data_dir / "formats" / "calibio" / "calibio_layout_example.json").values()
    camera = exact(imported)
    expected = [1500.25, 1501.75025, 961.5, 538.25, -0.11, 0.09, 0.0004, -0.0002, -0.01]
    np.testing.assert_allclose(camera.params, expected, rtol=1e-12)
    assert camera.image_size == (1920, 1080)
    assert [note.code for note in imported.notes] == ["unverified-convention"]  # where its pixels' origin is


@pytest.mark.parametrize("last", ["p2", "k3", "k6", "s4", "tauY"])
def test_all_coefficients_in_their_places(tmp_path: Path, last: str) -> None:
    chance = np.random.default_rng(5)
    d = {key: float(chance.normal(0, 0.01)) for key in ORDER[: ORDER.index(last) + 1]} | {"k3": 0.001}
    (imported,) = read(tmp_path, changed(**{key: d.get(key, 0.0) for key in ORDER})).values()
    expected = opencv(directions(30), (900.5, 900.5 * 1.001, 502, 398.5), [d.get(key, 0.0) for key in ORDER])
    agree(exact(imported).project(directions(30)), expected)


def test_later_cameras_have_the_number_of_the_class_only(tmp_path: Path) -> None:
    content = changed()
    second = copy.deepcopy(content["calibration"]["cameras"][0])
    del second["model"]["polymorphic_name"]
    second["model"]["polymorphic_id"] = 1
    content["calibration"]["cameras"].append(second)
    cameras = read(tmp_path, content)
    assert exact(cameras["0"]).params.tolist() == exact(cameras["1"]).params.tolist()
    second["model"]["polymorphic_id"] = 2
    with pytest.raises(NotExactError):
        exact(read(tmp_path, content)["1"])


def test_other_models_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(NotExactError, match="CameraModelDoubleSphere"):
        exact(read(tmp_path, changed({"polymorphic_name": "libCalib::CameraModelDoubleSphere"}))["0"])


def test_root_in_either_spelling(tmp_path: Path) -> None:
    assert read(tmp_path, {"Calibration": CALIBIO["calibration"]})


@pytest.mark.parametrize(
    "content", [changed(f=-1.0), changed(ar=0.0), {"calibration": {"cameras": []}, "a": "libCalib::"}]
)
def test_refused(tmp_path: Path, content: dict) -> None:
    path = tmp_path / "project.json"
    path.write_text(json.dumps(content))
    with pytest.raises(FileFormatError):
        CalibIo().read(path)
