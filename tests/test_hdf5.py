"""The camera file: read by OpenCSP's own way of loading, the oddities in the field, and damage of every kind."""

import contextlib
import os
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import opencsp_as_described
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from opencsp_calib import (
    Calibration,
    Camera,
    CharucoBoard,
    Checkerboard,
    Detection,
    InputError,
    Observations,
    Pose,
    Problem,
    RejectedCorner,
    SolveOptions,
    View,
)
from opencsp_calib.board import Board, RecordedBoard
from opencsp_calib.errors import CalibError, FileFormatError
from opencsp_calib.hdf5 import load_record, read_camera, save_camera
from opencsp_calib.hdf5_calibration import load_calibration, load_observations, save_calibration, save_observations
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.seal import LENGTH

PARAMS = [2710.1, 2704.3, 854.2, 628.1]


def camera_of(model: str) -> Camera:
    distortion = np.linspace(0.01, 0.02, len(LENS_MODELS[model].distortion_names))
    return Camera("Bäsler a|b 📷", model, np.concatenate([PARAMS, distortion]), (1626, 1236))


def as_opencsp_loads(path: Path) -> dict:
    return vars(opencsp_as_described.Camera.load_from_hdf(path))


@pytest.mark.parametrize("model", LENS_MODELS)
def test_a_camera_comes_back_to_the_last_bit(model: str, tmp_path: Path) -> None:
    camera = camera_of(model)
    camera.save(tmp_path / "c.h5")
    assert Camera.load(tmp_path / "c.h5") == camera


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


def observations(board: Board) -> Observations:
    rng = np.random.default_rng(3)
    count = len(board.points)

    def detection(covariance: bool) -> Detection:
        return Detection(
            rng.permutation(count)[: count - 1],
            rng.uniform(0, 1200, (count - 1, 2)),
            covariance=np.tile(np.eye(2) * 0.01, (count - 1, 1, 1)) if covariance else None,
            edge_width_px=rng.uniform(0.5, 2, count - 1) if covariance else None,
            rejected=(RejectedCorner(3, (1.5, 2.5), "glare"),),
            reason="partly hidden",
        )

    views = (
        View("a/1.png", detection(True), "used", (Problem("x", "y"),), "ab12"),
        View("a/2.png", Detection.nothing("no board here"), "no board"),
        View("ü 3.png", detection(False), "used"),
    )
    return Observations(board, (1626, 1236), views)


BOARDS = (
    Checkerboard(5, 4, 0.05),
    CharucoBoard(5, 4, 0.05, 0.03, "DICT_4X4_50", inverted=True),
    RecordedBoard(5, 4, 0.05, "dots:5x4:50mm"),
)


@pytest.mark.parametrize("board", BOARDS, ids=lambda b: b.kind)
def test_a_calibration_comes_back_whole(board: Board, tmp_path: Path) -> None:
    seen = observations(board.with_points(board.points + 1e-4))
    camera = camera_of("opencv5")
    poses = (
        Pose(np.array([0.1, 0.2, 0.3]), np.array([0, 0, 2.0])),
        Pose(np.array([0.3, 0, 0]), np.array([0, 0.1, 3.0])),
    )
    outliers = tuple(np.arange(len(d)) == 2 for d in seen.detections)
    options = SolveOptions(camera, "free", 1.0, "covariance", True)
    before = Calibration(
        camera,
        seen,
        poses,
        board.with_points(board.points * 1.001),
        "bundle 1.0",
        options,
        outliers=outliers,
        covariance=np.eye(9) * 4,
        problems=(Problem("p", "q"),),
        record={"aperture": "f/8"},
        provenance={"time": "now", "images": {"a/1.png": "/x"}},
    )
    save_calibration(before, tmp_path / "c.h5")
    after = load_calibration(tmp_path / "c.h5")
    assert type(after.board) is type(board)
    assert after.board == before.board
    assert after.observations.board == seen.board
    assert (after.camera, after.cam_from_board, after.solver) == (camera, poses, "bundle 1.0")
    assert after.options == options
    assert (after.problems, after.record, after.provenance) == (before.problems, before.record, before.provenance)
    assert after.rms_px == before.rms_px
    np.testing.assert_array_equal(after.covariance, before.covariance)
    assert np.isnan(after.covariance_residual).all()
    assert np.array_equal(np.concatenate(after.outliers), np.concatenate(outliers))
    for old, new in zip(seen.views, after.observations.views, strict=True):
        assert (new.image, new.status, new.problems, new.sha256) == (old.image, old.status, old.problems, old.sha256)
        assert (new.detection.rejected, new.detection.reason) == (old.detection.rejected, old.detection.reason)
        np.testing.assert_array_equal(new.detection.ids, old.detection.ids)
        np.testing.assert_array_equal(new.detection.pixels, old.detection.pixels)
        assert (new.detection.covariance is None) == (old.detection.covariance is None or not len(old.detection))


def test_observations_alone_come_back_and_have_no_camera(tmp_path: Path) -> None:
    save_observations(observations(BOARDS[0]), tmp_path / "o.h5")
    assert len(load_observations(tmp_path / "o.h5").used) == 2
    with pytest.raises(FileFormatError, match="no group /Camera"):
        Camera.load(tmp_path / "o.h5")


def test_a_camera_alone_cannot_be_solved_again(tmp_path: Path) -> None:
    camera_of("opencv4").save(tmp_path / "c.h5")
    with pytest.raises(FileFormatError, match="not how it was calibrated"):
        load_calibration(tmp_path / "c.h5")
    with pytest.raises(FileFormatError, match="no observations"):
        load_observations(tmp_path / "c.h5")


def change(path: Path, name: str, value: object) -> None:
    with h5py.File(path, "a") as file:
        if name in file:
            del file[name]
        if value is not None:
            file[name] = value


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("Camera/intrinsic_mat", np.eye(2), "shape"),
        ("Camera/intrinsic_mat", np.full((3, 3), np.nan), "finite"),
        ("Camera/intrinsic_mat", [[-5.0, 0, 1], [0, 5, 1], [0, 0, 1]], "positive"),
        ("Camera/intrinsic_mat", [[5.0, 1, 1], [0, 5, 1], [0, 0, 1]], "skew"),
        ("Camera/intrinsic_mat", "text", "numbers"),
        ("Camera/intrinsic_mat", None, "missing"),
        ("Camera/intrinsic_mat", h5py.SoftLink("/Camera/name"), "link"),
        ("Camera/intrinsic_mat", h5py.ExternalLink("other.h5", "/x"), "link"),
        ("Camera/distortion_coef", np.zeros(6), "6 distortion coefficients"),
        ("Camera/image_shape_xy", [0, 5], "positive whole"),
        ("Camera/image_shape_xy", h5py.Empty("i4"), "own"),
        ("Camera/name", ["a", "b"], "not one name"),
    ],
)
def test_a_foreign_file_that_makes_no_sense_is_refused(name: str, value: object, message: str, tmp_path: Path) -> None:
    path = tmp_path / "c.h5"
    camera_of("opencv4").save(path)
    with h5py.File(path, "a") as file:
        for attribute in list(file["Camera"].attrs):
            del file["Camera"].attrs[attribute]  # now it is OpenCSP's own file
    change(path, name, value)
    with pytest.raises(FileFormatError, match=message):
        Camera.load(path)


def test_a_changed_number_is_found_by_the_checksum(tmp_path: Path) -> None:
    path = tmp_path / "c.h5"
    camera_of("opencv4").save(path)
    change(path, "Camera/image_shape_xy", np.array([1626, 1235], dtype=np.int32))
    with pytest.raises(FileFormatError, match="checksum"):
        Camera.load(path)


def test_a_missing_checksum_is_found(tmp_path: Path) -> None:
    path = tmp_path / "c.h5"
    camera_of("opencv4").save(path)
    with h5py.File(path, "a") as file:
        del file["Camera"].attrs["checksum"]
    with pytest.raises(FileFormatError, match="checksum"):
        Camera.load(path)


def test_a_file_from_the_future_says_so(tmp_path: Path) -> None:
    path = tmp_path / "c.h5"
    camera_of("opencv4").save(path)
    with h5py.File(path, "a") as file:
        file["Camera"].attrs["format_version"] = 99
    with pytest.raises(FileFormatError, match="newer"):
        Camera.load(path)


def test_a_huge_dataset_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "c.h5"
    with h5py.File(path, "w") as file:
        file.create_dataset("Camera/intrinsic_mat", (2**40,), "f8", chunks=(1024,))
    with pytest.raises(FileFormatError):
        Camera.load(path)


def test_no_file_and_not_hdf5(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        Camera.load(tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(FileFormatError, match="not a camera file"):
        Camera.load(tmp_path / "text.h5")


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(data=st.data())
def test_damage_gives_an_error_or_the_same_camera(data: st.DataObject, tmp_path: Path) -> None:
    path = tmp_path / "damaged.h5"
    camera = camera_of("opencv4")
    camera.save(path)
    content = bytearray(path.read_bytes())
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    cut = data.draw(st.one_of(st.none(), st.integers(0, len(content))))
    path.write_bytes(bytes(content[:cut]))
    with contextlib.suppress(CalibError):
        assert Camera.load(path) == camera


def test_nothing_is_left_when_writing_fails(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "c.h5"
    camera_of("opencv4").save(path)
    before = path.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="No space left"):
        replace(camera_of("opencv4"), name="other").save(path)
    assert path.read_bytes() == before
    assert [p.name for p in tmp_path.iterdir()] == ["c.h5"]


def test_a_folder_that_is_not_there_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist; create it"):
        camera_of("opencv4").save(tmp_path / "no" / "c.h5")
    with pytest.raises(InputError, match="it is a folder"):
        camera_of("opencv4").save(tmp_path)


def test_a_sealed_file_is_plain_hdf5_and_loses_its_seal_when_another_program_changes_it(tmp_path: Path) -> None:
    path = tmp_path / "c.h5"
    camera = camera_of("opencv4")
    camera.save(path)
    assert b"sealed" in path.read_bytes()[-LENGTH:]
    with h5py.File(path, "a") as file:
        file["theirs"] = np.zeros(3)
    assert b"sealed" not in path.read_bytes()
    assert Camera.load(path) == camera


@pytest.mark.parametrize("cut", [1, 30, 64, LENGTH - 5])
def test_a_seal_that_is_cut_is_damage(cut: int, tmp_path: Path) -> None:
    path = tmp_path / "c.h5"
    camera_of("opencv4").save(path)
    path.write_bytes(path.read_bytes()[:-cut])
    if cut < LENGTH - 20:
        with pytest.raises(FileFormatError, match="damaged"):
            Camera.load(path)
    else:
        assert Camera.load(path) == camera_of("opencv4")  # nothing but the seal is lost


def test_every_single_byte_matters(tmp_path: Path) -> None:
    path = tmp_path / "o.h5"
    save_observations(observations(BOARDS[0]), path)
    content = path.read_bytes()
    for place in range(0, len(content), 23):
        path.write_bytes(content[:place] + bytes([content[place] ^ 0x10]) + content[place + 1 :])
        with pytest.raises(FileFormatError, match="damaged"):
            load_observations(path)
