"""COLMAP: pycolmap's own projection of every camera model, and its own reading of what we write."""

import struct
from pathlib import Path

import numpy as np
import pytest
from effort import at_most
from format_truth import directions
from opencsp_calib_formats.colmap import ColmapBinary, ColmapText
from opencsp_calib_formats.reading import FileFormat

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact, fitted

EXACT = {"SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "OPENCV_FISHEYE", "FULL_OPENCV"}
EXACT |= {"SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "SIMPLE_FISHEYE", "FISHEYE"}
TEXT = """# a comment
1 PINHOLE 1000 800 900.5 901.5 502.5 399
 7  THIN_PRISM_FISHEYE 1000 800 900.5 901.5 502.5 399 -0.01 0.005 0 0 0.001 0.0005 0 0

8 RAD_TAN_THIN_PRISM_FISHEYE 1000 800 900.5 901.5 502.5 399 -0.01 0.005 1e-3 5e-4 0 0 0 0 0 0 0 0
9 EUCM 1000 800 900.5 901.5 502.5 399 0 1.1
"""
PARAMS = {
    "pinhole": [],
    "opencv4": [-0.1, 0.02, 1e-3, -2e-3],
    "opencv5": [-0.1, 0.02, 1e-3, -2e-3, 1 / 3],
    "opencv8": [-0.1, 0.02, 1e-3, -2e-3, 1 / 3, 0.1, 1e-5, 1e-300],
    "opencv_fisheye": [-0.1, 0.02, 1e-3, -2e-3],
}


def camera_of(model: str, name: str = "a") -> Camera:
    return Camera(name, model, np.array([1000 / 3, 1001 / 3, 500.1, 399.9, *PARAMS[model]]), (1000, 800))


def of_pycolmap(model: str, params: list[float], size: tuple[int, int] = (1920, 1080)):
    """Its projection, moved from the corner of the first pixel to its centre."""
    pycolmap = pytest.importorskip("pycolmap")
    camera = pycolmap.Camera(model=model, width=size[0], height=size[1], params=params)
    return np.array(camera.img_from_cam(directions(40))) - 0.5


@pytest.mark.parametrize("format_", [ColmapText(), ColmapBinary()], ids=["text", "binary"])
def test_every_model_projects_as_pycolmap(data_dir: Path, format_: FileFormat) -> None:
    folder = data_dir / "formats" / "colmap"
    path = folder / f"all_models_cameras{format_.extensions[0]}"
    assert format_.recognises(path)
    cameras = format_.read(path)
    lines = [line.split() for line in (folder / "all_models_cameras.txt").read_text().splitlines() if line[0] != "#"]
    assert list(cameras) == [line[0] for line in lines]
    for id_, model, _, _, *params in lines:
        imported = cameras[id_]
        assert imported.image_size == (1920, 1080)
        assert (imported.camera is not None) == (model in EXACT), model
        if imported.project is None:
            assert model == "EQUIRECTANGULAR"
            continue
        ours, theirs = imported.project(directions(40)), of_pycolmap(model, [float(value) for value in params])
        seen = np.isfinite(ours).all(axis=1)
        assert seen.mean() > 0.6
        np.testing.assert_allclose(ours[seen], theirs[seen], rtol=0, atol=1e-9)


def test_what_is_in_the_way_is_named_and_only_that(data_dir: Path) -> None:
    cameras = ColmapText().read(data_dir / "formats" / "colmap" / "all_models_cameras.txt")
    with pytest.raises(NotExactError, match=r"omega = 0.9 \(FOV\).*--fit MODEL"):
        exact(cameras["8"])
    assert [o.split()[0] for o in cameras["11"].obstacles] == ["p1", "p2", "sx1", "sy1"]
    assert [o.split()[0] for o in cameras["12"].obstacles] == ["k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3"]
    with pytest.raises(NotExactError, match=r"EQUIRECTANGULAR.*cannot be fitted"):
        exact(cameras["18"])
    assert fitted(cameras["13"], "opencv8").worst_px < 1e-4
    assert fitted(cameras["8"], "opencv_fisheye").worst_px < 1e-4


def test_models_whose_terms_in_the_way_are_zero_are_exact(tmp_path: Path) -> None:
    path = tmp_path / "cameras.txt"
    path.write_text(TEXT)
    cameras = ColmapText().read(path)
    assert [exact(imported).model for imported in cameras.values()] == [
        "pinhole",
        "opencv_fisheye",
        "opencv_fisheye",
        "pinhole",
    ]
    for key, model in (("7", "THIN_PRISM_FISHEYE"), ("8", "RAD_TAN_THIN_PRISM_FISHEYE"), ("9", "EUCM")):
        params = next(line.split()[4:] for line in TEXT.splitlines() if line.split()[:1] == [key])
        theirs = of_pycolmap(model, [float(value) for value in params], (1000, 800))
        np.testing.assert_allclose(exact(cameras[key]).project(directions(40)), theirs, rtol=0, atol=1e-9)


@pytest.mark.parametrize("suffix", ["txt", "bin"])
def test_pycolmap_reads_what_we_write(suffix: str, tmp_path: Path) -> None:
    pycolmap = pytest.importorskip("pycolmap")
    format_ = ColmapText() if suffix == "txt" else ColmapBinary()
    cameras = {str(i): camera_of(model, str(i)) for i, model in enumerate(PARAMS, start=3)}
    for name in ("images", "points3D"):  # of a whole reconstruction, which it asks for
        (tmp_path / f"{name}.{suffix}").write_bytes(b"" if suffix == "txt" else bytes(8))
    format_.write(cameras, tmp_path / f"cameras.{suffix}")
    theirs = pycolmap.Reconstruction(str(tmp_path)).cameras
    assert sorted(theirs) == [int(key) for key in cameras]
    for key, camera in cameras.items():
        pixels = np.array(theirs[int(key)].img_from_cam(directions(30))) - 0.5
        np.testing.assert_allclose(camera.project(directions(30)), pixels, rtol=0, atol=1e-9)
    for key, imported in format_.read(tmp_path / f"cameras.{suffix}").items():
        again, count = exact(imported), len(cameras[key].params)
        np.testing.assert_allclose(again.params[:count], cameras[key].params, rtol=0, atol=1e-12)
        assert not again.params[count:].any()


def test_what_cannot_be_carried_is_not_written(tmp_path: Path) -> None:
    camera = Camera("a", "opencv12", np.array([900.0, 900, 500, 400, *np.arange(1, 13) * 1e-3]), (1000, 800))
    with pytest.raises(InputError, match=r"s4 = 0.012 is in the way"):
        ColmapText().write({"a": camera}, tmp_path / "cameras.txt")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (struct.pack("<Q", 2**60), "claims 1152921504606846976 cameras in 8 bytes"),
        (struct.pack("<Q", 2**60) + bytes(10_000), "claims"),
        (struct.pack("<QIiQQ", 1, 1, 0, 10, 10), "cut short"),
        (struct.pack("<QIiQQ", 1, 1, 99, 10, 10) + bytes(24), "unknown model 99"),
        (struct.pack("<QIiQQddd", 1, 1, 0, 2**63, 10, 9.0, 5.0, 5.0), "image_size"),
        (struct.pack("<QIiQQddd", 1, 1, 0, 10, 10, -9.0, 5.0, 5.0), "focal lengths must be positive"),
        (struct.pack("<QIiQQddd", 1, 1, 0, 10, 10, np.nan, 5.0, 5.0), "not a finite number"),
        (struct.pack("<QIiQQddd", 1, 1, 0, 10, 10, 9.0, 5.0, 5.0) + b"x", "1 bytes after the last camera"),
        (b"", "empty"),
    ],
)
def test_binary_files_that_lie(data: bytes, message: str, tmp_path: Path) -> None:
    path = tmp_path / "cameras.bin"
    path.write_bytes(data)
    with at_most(5), pytest.raises(FileFormatError, match=message):
        ColmapBinary().read(path)


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("1 OPENCV 10 10 9 9 5 5 0 0 0", "expected fx fy cx cy k1 k2 p1 p2"),
        ("1 OPENCV6 10 10 9 9 5 5", "no camera model 'OPENCV6'"),
        ("1 PINHOLE 10.5 10 9 9 5 5", "not a whole number"),
        ("1 PINHOLE 10 10 9 9 5 x", "not a number"),
        ("1 EUCM 10 10 9 9 5 5 2 1", "no EUCM camera"),
        ("1 PINHOLE 10 10 9 9 5 5\n1 PINHOLE 10 10 9 9 5 5", "there twice"),
    ],
)
def test_text_files_that_are_wrong(line: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "cameras.txt"
    path.write_text(f"# Camera list\n{line}\n")
    with pytest.raises(FileFormatError, match=message):
        ColmapText().read(path)
