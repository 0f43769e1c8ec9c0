"""The demo's photographs show what its truth says, and its work can be stopped."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from opencsp_calib import Camera, InputError, Pose
from opencsp_calib.demo import make_demo


def test_the_photographs_are_as_their_truth_says(tmp_path: Path) -> None:
    told = []
    world = make_demo(
        tmp_path / "new" / "demo", views=3, jobs=2, progress=lambda done, total: told.append((done, total))
    )
    assert told == [(1, 3), (2, 3), (3, 3)]
    assert [path.name for path in world.images] == ["001.png", "002.png", "003.png"]
    folder = tmp_path / "new" / "demo"
    assert sorted(path.name for path in folder.iterdir()) == ["001.png", "002.png", "003.png", "truth.json"]
    truth = json.loads((folder / "truth.json").read_text())
    assert truth["board"] == "checkerboard:21x18:50mm"
    params = list(truth["camera"]["params"].values())
    camera = Camera("demo", truth["camera"]["model"], params, tuple(truth["camera"]["image_size"]))
    assert camera == world.camera
    for view, pose in zip(truth["views"], world.poses, strict=True):
        stated = view["board_to_camera"]
        assert Pose(stated["rotation_rad"], stated["translation_m"]) == pose
        image = cv2.imread(folder / view["image"], cv2.IMREAD_UNCHANGED)
        assert image.shape == (1236, 1626)
        assert image.dtype == np.uint8
        expected = camera.project(pose.transform(world.board.points))
        window = (5, 5), (-1, -1), (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 50, 1e-4)
        start = np.rint(expected).astype(np.float32)
        found = cv2.cornerSubPix(image, start.copy(), *window).reshape(-1, 2)
        assert np.sqrt(((found - expected) ** 2).mean()) < 0.06


def test_stopping_ends_soon(tmp_path: Path) -> None:
    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_demo(tmp_path, views=40, jobs=2, progress=stop)
    assert len(list(tmp_path.glob("*.png"))) < 20  # on a busy machine some more are done before they are stopped
    assert not (tmp_path / "truth.json").exists()


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot make the folder"):
        make_demo(tmp_path / "file" / "demo", views=1)
    with pytest.raises(InputError, match="at least one view"):
        make_demo(tmp_path, views=0)
