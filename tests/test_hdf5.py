"""The camera file: what is written comes back, and OpenCSP's own way of loading reads it."""

import json
import re
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import opencsp_as_described
import pytest
from camera_files import BOARDS, camera_of, observations

from opencsp_calib import (
    Calibration,
    Camera,
    Pose,
    Problem,
    SolveOptions,
)
from opencsp_calib.board import Board
from opencsp_calib.errors import FileFormatError, InputError
from opencsp_calib.hdf5 import load_record, read_camera, save_camera
from opencsp_calib.hdf5_calibration import load_calibration, load_observations, save_calibration, save_observations
from opencsp_calib.models import LENS_MODELS


def as_opencsp_loads(path: Path) -> dict:
    return vars(opencsp_as_described.Camera.load_from_hdf(path))


@pytest.mark.parametrize("model", LENS_MODELS)
def test_a_camera_comes_back_to_the_last_bit(model: str, tmp_path: Path) -> None:
    camera = camera_of(model)
    camera.save(tmp_path / "c.h5")
    assert Camera.load(tmp_path / "c.h5") == camera


@pytest.mark.parametrize("name", ["c.yaml", "c.json", "c.png"])
def test_a_camera_is_not_saved_under_the_name_of_another_format(name: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"let its name end in \.h5; .* in Python by opencsp_calib.*write_camera_file"):
        camera_of("opencv4").save(tmp_path / name)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("model", [m for m in LENS_MODELS if m != "opencv_fisheye"])
def test_opencsp_reads_it_to_the_last_bit(model: str, tmp_path: Path) -> None:
    camera = camera_of(model)
    camera.save(tmp_path / "c.h5")
    loaded = as_opencsp_loads(tmp_path / "c.h5")
    np.testing.assert_array_equal(loaded["intrinsic_mat"], camera.matrix)
    expected = camera.distortion if camera.distortion.size else np.zeros(4)
    np.testing.assert_array_equal(loaded["distortion_coef"], expected)
    assert tuple(loaded["image_shape_xy"]) == camera.image_size
    assert loaded["image_shape_xy"].dtype == np.int32
    assert loaded["name"] == camera.name


def test_opencsp_refuses_a_fisheye_camera(tmp_path: Path) -> None:
    camera_of("opencv_fisheye").save(tmp_path / "c.h5")
    with pytest.raises(KeyError):
        as_opencsp_loads(tmp_path / "c.h5")


def test_cameras_in_use_are_read_with_their_oddities(data_dir: Path) -> None:
    folder = data_dir / "opencsp_cameras"
    plain, problems = read_camera(folder / "camera_sofast.h5")
    assert plain.name == "Basler Optics Lab Landscape"
    assert (plain.model, plain.image_size, problems) == ("opencv5", (1626, 1236), ())
    small, problems = read_camera(folder / "camera_sofast_downsampled.h5")
    assert small.image_size == (203, 154)
    assert problems[0].code == "scaled-matrix"
    assert "0.125" in problems[0].message


def test_a_record_is_kept_with_a_camera(tmp_path: Path) -> None:
    save_camera(camera_of("opencv4"), tmp_path / "c.h5", {"aperture": "f/8"})
    assert load_record(tmp_path / "c.h5") == {"aperture": "f/8"}
    save_camera(camera_of("opencv4"), tmp_path / "d.h5")
    assert load_record(tmp_path / "d.h5") == {}


def test_a_name_that_hdf5_cannot_hold_is_escaped(tmp_path: Path) -> None:
    """A zero byte, and half of a character, as names of files may have on Linux."""
    replace(camera_of("opencv4"), name="a\0b\udc80ü").save(tmp_path / "c.h5")
    assert Camera.load(tmp_path / "c.h5").name == r"a\0b\udc80ü"


def calibration_with(board: Board, model: str = "opencv5") -> Calibration:
    """One in which nothing is as it would be by default."""
    camera, seen = camera_of(model), observations(board.with_points(board.points + 1e-4))
    poses = (
        Pose(np.array([0.1, 0.2, 0.3]), np.array([0, 0, 2.0])),
        Pose(np.array([0.3, 0, 0]), np.array([0, 0.1, 3.0])),
    )
    return Calibration(
        camera,
        seen,
        poses,
        board.with_points(board.points * 1.001),
        "bundle 1.0",
        SolveOptions(camera, "free", 1.0, "covariance", True),
        outliers=tuple(np.arange(len(d)) == 2 for d in seen.detections),
        covariance=np.eye(len(camera.params)) * 4,
        problems=(Problem("p", "q"),),
        record={"aperture": "f/8"},
        provenance={"time": "now", "images": {"a/1.png": "/x"}},
    )


@pytest.mark.parametrize("board", BOARDS, ids=lambda b: b.kind)
def test_a_calibration_comes_back_whole(board: Board, tmp_path: Path) -> None:
    before = calibration_with(board)
    seen = before.observations
    save_calibration(before, tmp_path / "c.h5")
    after = load_calibration(tmp_path / "c.h5")
    assert type(after.board) is type(board)
    assert after.board == before.board
    assert after.observations.board == seen.board
    assert (after.camera, after.cam_from_board, after.solver) == (before.camera, before.cam_from_board, "bundle 1.0")
    assert after.options == before.options
    assert (after.problems, after.record, after.provenance) == (before.problems, before.record, before.provenance)
    assert after.rms_px == before.rms_px
    np.testing.assert_array_equal(after.covariance, before.covariance)
    assert np.isnan(after.covariance_residual).all()
    assert np.array_equal(np.concatenate(after.outliers), np.concatenate(before.outliers))
    for old, new in zip(seen.views, after.observations.views, strict=True):
        assert (new.image, new.status, new.problems, new.sha256) == (old.image, old.status, old.problems, old.sha256)
        assert (new.detection.rejected, new.detection.reason) == (old.detection.rejected, old.detection.reason)
        np.testing.assert_array_equal(new.detection.ids, old.detection.ids)
        np.testing.assert_array_equal(new.detection.pixels, old.detection.pixels)
        assert (new.detection.covariance is None) == (old.detection.covariance is None or not len(old.detection))


def as_the_page_says() -> dict[str, str]:
    """Shape and type of each dataset, by docs/file_format.md."""
    page = (Path(__file__).parents[1] / "docs" / "file_format.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (`.*`) \| (.*?) \|", page, flags=re.MULTILINE)
    kinds = {name: kind for names, kind in rows for name in re.findall(r"`(.*?)`", names)}
    return {name.lstrip("/") if name[0] == "/" else f"Calibration/{name}": kind for name, kind in kinds.items()}


@pytest.mark.parametrize(("model", "missing"), [("opencv5", "fisheye"), ("opencv_fisheye", "distortion")])
def test_a_file_holds_what_its_page_says(model: str, missing: str, tmp_path: Path) -> None:
    save_calibration(calibration_with(BOARDS[0], model), tmp_path / "c.h5")
    found: dict[str, h5py.Dataset] = {}
    sizes: dict[str, int] = {}  # of the page's letters
    described = as_the_page_says()
    del described[f"Camera/{missing}_coef"]
    with h5py.File(tmp_path / "c.h5") as file:
        file.visititems(lambda name, item: found.update({name: item}) if isinstance(item, h5py.Dataset) else None)
        assert found.keys() == described.keys()
        for name, kind in described.items():
            if kind == "JSON":
                json.loads(found[name].asstr()[()])
            elif kind == "string":
                assert found[name].asstr()[()]
            else:
                letters, dtype = re.fullmatch(r"\((.*?),?\) (\w+)", kind).groups()
                assert found[name].dtype == np.dtype(dtype), name
                for letter, size in zip(letters.split(", "), found[name].shape, strict=True):
                    wanted = int(letter) if letter.isdigit() else sizes.setdefault(letter, size)
                    assert letter == "n" or size == wanted, name  # n is another one in each group


@pytest.mark.parametrize(
    ("name", "value", "what"),
    [
        ("pixels", np.nan, r"view 1 of .*NaN"),
        ("ids", None, r"view 1 of .*same corner twice"),
        ("ids", 9999, "names a corner that the board"),
        ("board_points", np.nan, "board points has"),
    ],
)
def test_corners_that_cannot_be_are_refused_by_name(name: str, value: float | None, what: str, tmp_path: Path) -> None:
    """By a file that somebody else made: ours does not write such."""
    path = tmp_path / "observed.h5"
    save_observations(observations(BOARDS[0]), path)
    with h5py.File(path, "a") as file:
        dataset = file["Calibration/observations"][name]
        dataset[0] = dataset[1] if value is None else value
    with pytest.raises(FileFormatError, match=rf"observed\.h5: .*{what}"):
        load_observations(path)


def test_observations_alone_come_back_and_have_no_camera(tmp_path: Path) -> None:
    save_observations(observations(BOARDS[0]), tmp_path / "o.h5")
    assert len(load_observations(tmp_path / "o.h5").used) == 2
    with pytest.raises(FileFormatError, match="but no camera: `opencsp-calib solve"):
        Camera.load(tmp_path / "o.h5")


def test_a_camera_alone_cannot_be_solved_again(tmp_path: Path) -> None:
    camera_of("opencv4").save(tmp_path / "c.h5")
    with pytest.raises(FileFormatError, match="not how it was calibrated"):
        load_calibration(tmp_path / "c.h5")
    with pytest.raises(FileFormatError, match="no observations"):
        load_observations(tmp_path / "c.h5")
