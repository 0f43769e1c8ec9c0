"""multical: OpenCV's numbers in nested lists."""

import copy
import json
from pathlib import Path

import numpy as np
import pytest
from format_files_robotics import MULTICAL
from format_truth import agree, directions, opencv
from opencsp_calib_formats.multical import Multical

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

K = (900.5, 901.5, 502.0, 398.5)


def read(tmp_path: Path, **changes: object):
    content = copy.deepcopy(MULTICAL)
    content["cameras"]["left"] |= changes
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(content))
    assert Multical().recognises(path)
    return Multical().read(path)["left"]


def test_real_file_whose_numbers_are_absurd_but_cameras(data_dir: Path) -> None:
    cameras = Multical().read(data_dir / "formats" / "multical" / "calibration.json")
    assert list(cameras) == ["cam1", "cam2", "cam3"]
    camera = exact(cameras["cam3"])
    expected = [612.7812469659273, 1718.0334787994939, 2114.756636653719, 4986.571857280371]
    np.testing.assert_array_equal(camera.params[:4], expected)
    assert camera.image_size == (2880, 1606)


@pytest.mark.parametrize(("model", "count"), [("standard", 5), ("rational", 8), ("thin_prism", 12), ("tilted", 14)])
def test_opencvs_coefficients(tmp_path: Path, model: str, count: int) -> None:
    d = np.random.default_rng(3).normal(0, 0.01, count)
    camera = exact(read(tmp_path, model=model, dist=[d.tolist()]))
    agree(camera.project(directions(30)), opencv(directions(30), K, d))


def test_skew_and_unknown_models_are_refused(tmp_path: Path) -> None:
    with pytest.raises(NotExactError, match="skew"):
        exact(read(tmp_path, K=[[900.5, 1.5, 502], [0, 901.5, 398.5], [0, 0, 1]]))
    with pytest.raises(NotExactError, match="fisheye"):
        exact(read(tmp_path, model="fisheye"))


@pytest.mark.parametrize(
    "changes", [{"dist": [[1, 2, 3]]}, {"image_size": [1000]}, {"K": [[1, 0], [0, 1]]}, {"dist": "a"}]
)
def test_refused(tmp_path: Path, changes: dict) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, **changes)
