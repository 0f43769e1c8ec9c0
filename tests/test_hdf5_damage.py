"""Camera files that are damaged, changed, foreign or cannot be written: an error, and never a wrong number."""

import contextlib
import os
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from camera_files import BOARDS, camera_of, observations
from hypothesis import given, settings
from hypothesis import strategies as st

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import CalibError, FileFormatError
from opencsp_calib.hdf5_calibration import load_observations, save_observations
from opencsp_calib.hdf5_writing import write_hdf5
from opencsp_calib.seal import LENGTH


@pytest.fixture
def saved(tmp_path: Path) -> Path:
    """A camera file, alone in its folder."""
    path = tmp_path / "c.h5"
    camera_of("opencv4").save(path)
    return path


@pytest.fixture
def foreign(saved: Path) -> Path:
    """One as OpenCSP itself writes it, without what we add."""
    with h5py.File(saved, "a") as file:
        for attribute in list(file["Camera"].attrs):
            del file["Camera"].attrs[attribute]
    assert Camera.load(saved) == camera_of("opencv4")
    return saved


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
        ("Camera/intrinsic_mat", [[5.0, 0.5, 1], [0, 5, 1], [0, 0, 1]], r"skew \(0\.5\)"),
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
def test_a_foreign_file_that_makes_no_sense_is_refused(name: str, value: object, message: str, foreign: Path) -> None:
    change(foreign, name, value)
    with pytest.raises(FileFormatError, match=message):
        Camera.load(foreign)


def test_a_changed_number_is_found_by_the_checksum(saved: Path) -> None:
    change(saved, "Camera/image_shape_xy", np.array([1626, 1235], dtype=np.int32))
    with pytest.raises(FileFormatError, match="checksum"):
        Camera.load(saved)


def test_a_missing_checksum_is_found(saved: Path) -> None:
    with h5py.File(saved, "a") as file:
        del file["Camera"].attrs["checksum"]
    with pytest.raises(FileFormatError, match="checksum"):
        Camera.load(saved)


def test_a_file_from_the_future_says_so(saved: Path) -> None:
    with h5py.File(saved, "a") as file:
        file["Camera"].attrs["format_version"] = 99
    with pytest.raises(FileFormatError, match="newer"):
        Camera.load(saved)


def test_a_huge_dataset_is_not_read(foreign: Path) -> None:
    with h5py.File(foreign, "a") as file:
        del file["Camera/intrinsic_mat"]
        file.create_dataset("Camera/intrinsic_mat", (2**40,), "f8", chunks=(1024,))
    with pytest.raises(
        FileFormatError, match="intrinsic_mat has 1099511627776 values, more than a camera file can need"
    ):
        Camera.load(foreign)


@pytest.mark.parametrize(
    ("kind", "options"), [("f8", {"chunks": (4000, 4000), "maxshape": (None, None)}), ("S500000000", {})]
)
def test_a_small_dataset_that_takes_much_memory_is_not_read(kind: str, options: dict, foreign: Path) -> None:
    with h5py.File(foreign, "a") as file:
        del file["Camera/intrinsic_mat"]
        file.create_dataset("Camera/intrinsic_mat", (3, 3), kind, **options)
    with pytest.raises(FileFormatError, match="intrinsic_mat takes more memory than a camera file can need"):
        Camera.load(foreign)


def test_no_file_and_not_hdf5(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        Camera.load(tmp_path / "none.h5")
    (tmp_path / "text.h5").write_text("hello")
    with pytest.raises(FileFormatError, match=r"text.h5 is not HDF5, .* another file is meant"):
        Camera.load(tmp_path / "text.h5")
    (tmp_path / "text.h5").write_text("")
    with pytest.raises(FileFormatError, match=r"text.h5 is empty"):
        Camera.load(tmp_path / "text.h5")


@settings(max_examples=150)
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


def test_nothing_is_left_when_writing_fails(saved: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = saved.read_bytes()

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(InputError, match="No space left"):
        replace(camera_of("opencv4"), name="other").save(saved)
    assert saved.read_bytes() == before
    assert list(saved.parent.iterdir()) == [saved]


def test_a_folder_that_is_not_there_says_so(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist; create it"):
        camera_of("opencv4").save(tmp_path / "no" / "c.h5")
    with pytest.raises(InputError, match="it is a folder"):
        camera_of("opencv4").save(tmp_path)


def test_a_sealed_file_is_plain_hdf5_and_loses_its_seal_when_another_program_changes_it(saved: Path) -> None:
    assert b"sealed" in saved.read_bytes()[-LENGTH:]
    with h5py.File(saved, "a") as file:
        file["theirs"] = np.zeros(3)
    assert b"sealed" not in saved.read_bytes()
    assert Camera.load(saved) == camera_of("opencv4")


@pytest.mark.parametrize("cut", [1, 30, 64, LENGTH - 5])
def test_a_seal_that_is_cut_is_damage(cut: int, saved: Path) -> None:
    saved.write_bytes(saved.read_bytes()[:-cut])
    if cut < LENGTH - 20:
        with pytest.raises(FileFormatError, match="damaged"):
            Camera.load(saved)
    else:
        assert Camera.load(saved) == camera_of("opencv4")  # nothing but the seal is lost


def test_every_single_byte_matters(tmp_path: Path) -> None:
    path = tmp_path / "o.h5"
    save_observations(observations(BOARDS[0]), path)
    content = path.read_bytes()
    for place in range(0, len(content), 23):
        path.write_bytes(content[:place] + bytes([content[place] ^ 0x10]) + content[place + 1 :])
        with pytest.raises(FileFormatError, match="damaged"):
            load_observations(path)


@pytest.mark.skipif(sys.platform == "win32", reason="has no limit on the size of files")
def test_what_a_full_disk_has_not_taken_can_be_read_while_writing(tmp_path: Path) -> None:
    import resource

    read = []

    def fill(file: h5py.File) -> None:
        for index in range(3):
            file[f"numbers{index}"] = np.arange(1000.0) + index
        file.flush()
        read.extend(file[f"numbers{index}"][()] for index in range(3))

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (12000, before[1]))
    try:
        with pytest.raises(InputError, match="File too large"):
            write_hdf5(tmp_path / "n.h5", fill)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    np.testing.assert_array_equal(read, np.arange(1000.0) + np.arange(3.0)[:, None])
    assert list(tmp_path.iterdir()) == []
