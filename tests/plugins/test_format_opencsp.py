"""The camera file among the formats: OpenCSP's own and ours."""

from pathlib import Path

import numpy as np
import pytest
from format_files_calibration import HDF5_FILES, D, K
from matlab_files import hdf5
from opencsp_calib_formats.matlab import Matlab
from opencsp_calib_formats.opencsp import OpenCSP

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import FileFormatError
from opencsp_calib.importing import exact, recognise
from opencsp_calib.registry import installed

CAMERA = Camera("the lens", "opencv8", np.array([1000 / 3, 9e2, 502.1, 398, *D, 1e-300, 0, 0.1]), (1000, 800))


def test_opencsps_own(tmp_path: Path) -> None:
    path = tmp_path / "camera.h5"
    path.write_bytes(HDF5_FILES["opencsp"]())
    assert recognise(path, installed().camera_formats).name == "opencsp"
    camera = exact(OpenCSP().read(path)["a"])
    assert np.array_equal(camera.matrix, K)
    assert np.array_equal(camera.distortion, D)
    assert camera.image_size == (1000, 800)


def test_written_and_read(tmp_path: Path) -> None:
    path = tmp_path / "camera.h5"
    OpenCSP().write({"x": CAMERA}, path)
    assert exact(OpenCSP().read(path)["the lens"]) == CAMERA
    assert Camera.load(path) == CAMERA
    with pytest.raises(InputError, match="one camera, not 2"):
        OpenCSP().write({"x": CAMERA, "y": CAMERA}, path)


def test_matlabs_files_are_hdf5_too_and_not_taken_for_ours(tmp_path: Path) -> None:
    path = hdf5(tmp_path / "a.mat", {"Camera": {"K": np.array(K), "RadialDistortion": [[0.0, 0.0]]}})
    assert not OpenCSP().recognises(path)
    assert Matlab().recognises(path)
    for content in (b"", b"\x89HDF\r\n\x1a\n", b"\x89HDF\r\n\x1a\n" + bytes(3000)):
        path.write_bytes(content)
        assert not OpenCSP().recognises(path)
        with pytest.raises(FileFormatError):
            OpenCSP().read(path)
