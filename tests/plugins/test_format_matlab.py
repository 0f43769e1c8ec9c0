"""MATLAB: its documented formula against the reader, for structures, saved objects, v7.3 and JSON."""

import contextlib
import json
import struct
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
import pytest
from effort import at_most
from format_truth import agree, directions, perspective
from hypothesis import given, settings
from hypothesis import strategies as st
from matlab_files import CELL, MATRIX, element, hdf5, matrix, object_file, of_value, structures, v5
from opencsp_calib_formats.mat_file import read_mat
from opencsp_calib_formats.matlab import Matlab
from scipy.io import loadmat, savemat

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact, fitted
from opencsp_calib.interfaces import Imported

K = np.array([[900.5, 0.0, 503.0], [0.0, 901.5, 399.5], [0.0, 0.0, 1.0]])
PARAMETERS = {
    "RadialDistortion": np.array([[-0.1, 0.02, -0.003]]),
    "TangentialDistortion": np.array([[0.001, -0.002]]),
    "ImageSize": np.array([[800.0, 1000.0]]),
    "WorldUnits": "millimeters",
    "IntrinsicMatrix": K.T,
}


def read(path: Path, data: bytes) -> Mapping[str, Imported]:
    path.write_bytes(data)
    assert Matlab().recognises(path)
    return Matlab().read(path)


def changed(**fields: object) -> dict[str, object]:
    return {key: value for key, value in {**PARAMETERS, **fields}.items() if value is not None}


def formula(k=K, radial=(-0.1, 0.02, -0.003), tangential=(0.001, -0.002)):
    """What cameraIntrinsics documents, pixels counted from 1 and then from 0."""
    x, y = perspective(directions())
    r2 = x**2 + y**2
    factor = 1 + sum(c * r2 ** (i + 1) for i, c in enumerate(radial))
    xd = x * factor + 2 * tangential[0] * x * y + tangential[1] * (r2 + 2 * x**2)
    yd = y * factor + tangential[0] * (r2 + 2 * y**2) + 2 * tangential[1] * x * y
    return np.column_stack([k[0, 0] * xd + k[0, 1] * yd + k[0, 2], k[1, 1] * yd + k[1, 2]]) - 1.0


def same_as_formula(imported: Imported) -> None:
    camera = exact(imported)
    assert camera.image_size == (1000, 800)
    agree(camera.project(directions()), formula())


@pytest.mark.parametrize("matrix_field", [{"IntrinsicMatrix": K.T}, {"IntrinsicMatrix": None, "K": K}])
def test_both_orientations_in_every_container(matrix_field: dict[str, object], tmp_path: Path) -> None:
    fields = changed(**matrix_field)
    same_as_formula(read(tmp_path / "a.mat", structures({"p": fields}))["p"])
    same_as_formula(Matlab().read(hdf5(tmp_path / "b.mat", {"p": fields}))["p"])
    listed = {key: value.tolist() if isinstance(value, np.ndarray) else value for key, value in fields.items()}
    same_as_formula(read(tmp_path / "c.json", json.dumps(listed).encode())["camera"])
    same_as_formula(read(tmp_path / "d.json", json.dumps({"q": listed}).encode())["q"])


def test_intrinsics_with_focal_length_and_skew(tmp_path: Path) -> None:
    fields = changed(
        IntrinsicMatrix=None, FocalLength=[[900.5, 901.5]], PrincipalPoint=[[503.0, 399.5]], Skew=np.array([[0.0]])
    )
    same_as_formula(read(tmp_path / "a.mat", structures({"p": fields}))["p"])
    listed = {key: np.squeeze(value).tolist() for key, value in fields.items()}  # as jsonencode writes: Skew bare
    same_as_formula(read(tmp_path / "b.json", json.dumps(listed).encode())["camera"])
    imported = read(tmp_path / "b.mat", structures({"p": {**fields, "Skew": 2.5}}))["p"]
    with pytest.raises(NotExactError, match=r"skew = 2.5 px"):
        exact(imported)
    k = K.copy()
    k[0, 1] = 2.5
    agree(imported.project(directions()), formula(k))


def test_saved_object_under_the_name_of_its_variable(tmp_path: Path) -> None:
    """The metadata, an empty cell, the structure that saveobj returned, and defaults: as MATLAB writes a file."""
    for compress in (True, False):
        cells = [np.zeros((40, 1), np.uint8), np.zeros((0, 0)), changed(WorldUnits=1.0), np.zeros((3, 1))]
        data = object_file(cells, {"cameraParams": "cameraParameters"}, compress=compress)
        cameras = read(tmp_path / "cameraParams.mat", data)
        assert list(cameras) == ["cameraParams"]
        same_as_formula(cameras["cameraParams"])


def test_saved_object_in_hdf5(tmp_path: Path) -> None:
    """Its variable is six numbers with an attribute, its data a structure among the references."""
    path = hdf5(tmp_path / "a.mat", {"cameraParams": np.zeros((6, 1)), "#refs#": {"b": np.eye(2), "c": PARAMETERS}})
    with h5py.File(path, "r+") as file:
        file["cameraParams"].attrs["MATLAB_object_decode"] = np.int32(3)
        references = file.create_dataset("#subsystem#/MCOS", (1, 2), h5py.ref_dtype)
        references[0, 0], references[0, 1] = file["#refs#/b"].ref, file["#refs#/c"].ref
    assert Matlab().recognises(path)
    cameras = Matlab().read(path)
    assert list(cameras) == ["cameraParams"]
    same_as_formula(cameras["cameraParams"])


def test_stereo_and_sessions(tmp_path: Path) -> None:
    other = changed(WorldUnits=1.0, IntrinsicMatrix=(K * [[2, 1, 1], [1, 2, 1], [1, 1, 1]]).T)
    pair = {"CameraParameters1": changed(WorldUnits=1.0), "CameraParameters2": other, "TranslationOfCamera2": np.eye(3)}
    assert list(read(tmp_path / "s.mat", structures({"stereoParams": pair}))) == [
        "stereoParams.CameraParameters1",
        "stereoParams.CameraParameters2",
    ]
    cells = [np.zeros((40, 1), np.uint8), pair, changed(WorldUnits=1.0)]  # one of them a second time
    cameras = read(tmp_path / "o.mat", object_file(cells, {"stereoParams": "stereoParameters"}))
    assert list(cameras) == ["stereoParams.CameraParameters1", "stereoParams.CameraParameters2"]
    same_as_formula(cameras["stereoParams.CameraParameters1"])
    assert exact(cameras["stereoParams.CameraParameters2"]).params[0] == 1801.0


def test_old_file_without_image_size_asks_for_it(tmp_path: Path) -> None:
    imported = read(tmp_path / "a.mat", structures({"p": changed(ImageSize=None)}))["p"]
    assert imported.image_size is None
    assert imported.resize is not None
    same_as_formula(imported.resize((1000, 800)))


def test_kannala_brandt(tmp_path: Path) -> None:
    fields = {"DistortionCoefficients": [[0.01, -0.02, 0.003, 0.0]], "K": K, "ImageSize": [[800, 1000]]}
    camera = exact(read(tmp_path / "a.mat", structures({"p": fields}))["p"])
    assert camera.model == "opencv_fisheye"
    np.testing.assert_array_equal(camera.params, [900.5, 901.5, 502.0, 398.5, 0.01, -0.02, 0.003, 0.0])


def test_scaramuzza_is_offered_for_a_fit(tmp_path: Path) -> None:
    """The documented direction is from the image to the ray: pixels are made into rays here, and must come back."""
    a0, a2, a3, a4 = 350.0, -1.1e-3, 4e-7, -6e-10
    stretch, centre = np.array([[1.001, 0.002], [0.001, 1.0]]), np.array([512.0, 398.0])
    fields = {
        "MappingCoefficients": [[a0, a2, a3, a4]],
        "DistortionCenter": centre[None],
        "StretchMatrix": stretch,
        "ImageSize": [[800, 1000]],
    }
    imported = read(tmp_path / "a.mat", structures({"p": fields}))["p"]
    with pytest.raises(NotExactError, match="MappingCoefficients"):
        exact(imported)
    x, y = np.meshgrid(np.linspace(1, 1000, 30), np.linspace(1, 800, 24))
    pixels = np.column_stack([x.ravel(), y.ravel()])
    u, v = np.linalg.solve(stretch, (pixels - centre).T)
    rho = np.hypot(u, v)
    rays = np.column_stack([u, v, a0 + a2 * rho**2 + a3 * rho**3 + a4 * rho**4])
    np.testing.assert_allclose(imported.project(rays), pixels - 1.0, rtol=0, atol=1e-6)
    found = fitted(imported, "opencv_fisheye", 5.0)
    assert found.worst_px < 5.0


def test_derived_files(data_dir: Path) -> None:
    folder = data_dir / "formats" / "matlab"
    for name in ("IntrinsicMatrix", "K"):
        five, seven = (exact(Matlab().read(folder / f"toStruct_{name}_{v}.mat")["s"]) for v in ("v5", "v73"))
        assert np.array_equal(five.params, seven.params)
        assert five.image_size == seven.image_size
    np.testing.assert_allclose(five.params, [531.6624049, 521.98904034, 434.39940472, 237.84588245, -0.0065426,
                                             0.01490159, 0, 0], rtol=1e-6)  # fmt: skip


@pytest.mark.parametrize("compress", [True, False])
def test_the_reader_of_v5_agrees_with_scipys(compress: bool, tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    numbers = {f"n_{t}": (rng.normal(size=(3, 4)) * 99).astype(t) for t in ("f8", "f4", "i1", "u1", "i2", "u4", "i8")}
    cells = np.empty((1, 3), dtype=object)
    cells[:] = [[np.eye(2), "text", np.zeros((0, 0))]]
    inner = {"a": np.arange(3.0)[None], "word": "é", "deeper": {"x": np.array([[True]])}}
    variables = {**numbers, "c": cells, "s": inner, "t": "héllo", "cube": rng.normal(size=(2, 3, 4))}
    path = tmp_path / "a.mat"
    savemat(path, variables, do_compression=compress)
    ours, theirs = read_mat(path), loadmat(path)
    for name in [*numbers, "cube"]:
        assert np.array_equal(ours[name], theirs[name])
    assert ours["t"] == theirs["t"][0]
    assert np.array_equal(ours["c"][0], np.eye(2))
    assert (ours["c"][1], ours["c"][2].shape) == ("text", (0, 0))
    assert np.array_equal(ours["s"]["a"], theirs["s"]["a"][0, 0])
    assert (ours["s"]["word"], ours["s"]["deeper"]["x"][0, 0]) == ("é", 1)
    savemat(path, {"z": np.array([[1j]]), "x": 1.0})
    assert read_mat(path) == {"z": None, "x": 1.0}


def test_claims_are_not_believed(tmp_path: Path) -> None:
    """Of elements, of what is unpacked, of dimensions, of fields: none is allocated before it is there."""
    bomb = v5(of_value([]), element(MATRIX, bytes(2**26)), compress=True)
    claims = [
        v5(struct.pack("<II", MATRIX, 2**31)),
        v5(matrix(CELL, (2**31 - 1, 1), "a", b"")),
        v5(matrix(CELL, (2**20, 2**20), "a", of_value(1.0))),
        v5(matrix(6, (2**16, 2**16), "a", element(9, bytes(8)))),
        v5(matrix(4, (1, 2**30), "a", element(16, b""))),
        v5(matrix(CELL, (1, -1), "a", b"")),
        bomb,
    ]
    for data in claims:
        path = tmp_path / "a.mat"
        path.write_bytes(data)
        with at_most(5):
            assert not Matlab().recognises(path)
            with pytest.raises(FileFormatError):
                Matlab().read(path)


def test_nested_without_end(tmp_path: Path) -> None:
    data = of_value(1.0)
    for _ in range(200):
        data = matrix(CELL, (1, 1), "", data)
    path = tmp_path / "a.mat"
    path.write_bytes(v5(data))
    with pytest.raises(FileFormatError, match="nested"):
        Matlab().read(path)


@settings(max_examples=150)
@given(st.data())
def test_damaged_objects(tmp_path_factory: pytest.TempPathFactory, data: st.DataObject) -> None:
    cells = [np.zeros((40, 1), np.uint8), changed(WorldUnits=1.0)]
    content = bytearray(object_file(cells, {"cameraParams": "cameraParameters"}, compress=False))
    for _ in range(data.draw(st.integers(1, 4))):
        content[data.draw(st.integers(128, len(content) - 1))] = data.draw(st.integers(0, 255))
    path = tmp_path_factory.getbasetemp() / "damaged.mat"
    path.write_bytes(bytes(content))
    with contextlib.suppress(FileFormatError):
        Matlab().read(path)
