"""OpenCV FileStorage: cv2 itself reads what we write and writes what we read; home-made files by their usual names."""

import json
from collections.abc import Mapping
from pathlib import Path

import cv2
import numpy as np
import pytest
from format_truth import agree, directions, opencv, opencv_fisheye
from hypothesis import given, settings
from hypothesis import strategies as st
from opencsp_calib_formats.opencv_filestorage import OpenCVFileStorage

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact, pick, recognise
from opencsp_calib.interfaces import Imported
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.registry import installed

K = [[900.5, 0.0, 502.0], [0.0, 901.5, 398.5], [0.0, 0.0, 1.0]]
D = [-0.1, 0.02, 0.001, -0.002, -0.003]
FLAT = [value for row in K for value in row]
ROWS = "".join(f"- {row}\n" for row in K)
NO_SPACES = f"""%YAML:1.0
image_width:1000
image_height:800
K: !!opencv-matrix
   rows: 3
   cols: 3
   data: {FLAT}
D: {D}
"""
XML = f"""<opencv_storage>
<K><rows>3</rows><cols>3</cols><data>{str(FLAT)[1:-1]}</data></K>
<D>{"".join(f"<_>{value}</_>" for value in D)}</D>
<imageSize>1000 800</imageSize>
</opencv_storage>
"""
FORMAT = OpenCVFileStorage()


def read(path: Path, text: str) -> Mapping[str, Imported]:
    path.write_text(text, encoding="utf-8")
    assert FORMAT.recognises(path)
    return FORMAT.read(path)


def expected(coefficients=D):
    return opencv(directions(), [900.5, 901.5, 502.0, 398.5], coefficients)


def stored(path: Path, **values: object) -> Path:
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
    for key, value in values.items():
        storage.write(key, value)
    storage.release()
    return path


@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
@pytest.mark.parametrize("count", [5, 8, 12, 14])
def test_reads_what_cv2_writes(suffix: str, count: int, tmp_path: Path) -> None:
    d = np.concatenate([D, [0.01, 0.02, 0.003, 1e-5, 2e-6, 3e-5, -1e-6, 0.01, -0.02]])[:count]
    path = tmp_path / f"camera.{suffix}"
    stored(path, image_width=1000, image_height=800, camera_matrix=np.array(K), distortion_coefficients=d)
    assert FORMAT.recognises(path)
    camera = exact(FORMAT.read(path)["camera"])
    assert (camera.model, camera.image_size) == (f"opencv{count}", (1000, 800))
    agree(camera.project(directions()), expected(d))


@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
@pytest.mark.parametrize("model", sorted(LENS_MODELS))
def test_cv2_reads_what_we_write(suffix: str, model: str, tmp_path: Path) -> None:
    count = len(LENS_MODELS[model].distortion_names)
    params = np.array([1000 / 3, 1e3, 502.1, 398.7, *(np.arange(1, count + 1) * 1e-5 / 3)])
    camera = Camera('a "b" <&> é', model, params, (1000, 800))
    path = tmp_path / f"camera.{suffix}"
    FORMAT.write({camera.name: camera}, path)
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("camera_matrix").mat(), camera.matrix)
    coefficients = storage.getNode("distortion_coefficients").mat().ravel()
    np.testing.assert_array_equal(coefficients[:count], camera.distortion)
    assert not coefficients[count:].any()
    assert storage.getNode("image_width").real() == 1000
    ((key, imported),) = FORMAT.read(path).items()
    again = exact(imported)
    assert key == again.name == camera.name
    np.testing.assert_array_equal(again.params[: len(params)], camera.params)
    assert again.model == ("opencv4" if model == "pinhole" else model)


@settings(max_examples=40)
@given(st.lists(st.floats(-1e40, 1e40), min_size=7, max_size=7), st.sampled_from(["yml", "xml", "json"]))
def test_written_and_read_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory, values: list[float], suffix
) -> None:
    camera = Camera("a", "opencv5", np.array([1e-300, 5e40, *values]), (9, 7))
    path = tmp_path_factory.getbasetemp() / f"bits.{suffix}"
    FORMAT.write({"a": camera}, path)
    assert exact(FORMAT.read(path)["a"]) == camera


@pytest.mark.parametrize("suffix", ["yml", "xml", "json"])
def test_stereo_pair(suffix: str, tmp_path: Path) -> None:
    left, right = (
        Camera(n, "opencv5", np.array([f, f, 502, 398, *D]), (1000, 800)) for n, f in (("l", 9e2), ("r", 8e2))
    )
    path = tmp_path / f"intrinsics.{suffix}"
    FORMAT.write({"l": left, "r": right}, path)
    storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
    np.testing.assert_array_equal(storage.getNode("M2").mat(), right.matrix)
    cameras = FORMAT.read(path)
    assert [exact(imported) for imported in cameras.values()] == [left, right]
    with pytest.raises(InputError, match="the file has 2 cameras; choose one with --camera: 1, 2"):
        pick(cameras)
    with pytest.raises(InputError, match="stereo pair, not 3"):
        FORMAT.write({"a": left, "b": left, "c": left}, path)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (json.dumps({"mtx": K, "dist": [D], "image_size": [1000, 800]}), "camera"),
        (json.dumps({"camera_matrix": K, "dist_coeff": D, "w": 1000, "h": 800}), "camera"),
        (json.dumps({"K": FLAT, "D": D, "resolution": {"width": 1000, "height": 800}}), "camera"),
        (json.dumps({"cameraMatrix": K, "distCoeffs": [[d] for d in D], "img_shape": [800, 1000, 3]}), "camera"),
        (json.dumps([{"intrinsic_matrix": K, "distortion": D, "imageSize": "1000 800"}]), "0"),
        (json.dumps({"size": [1000, 800], "left": {"K": K, "dist": D}, "about": {"K": 5}}), "left"),
        (json.dumps({"width": 9, "height": 6, "K": K, "D": D, "frame_size": [1000, 800]}), "camera"),  # the board's
        (f"K_left:\n{ROWS}D_left: {D}\nimage_width: 1000\nimage_height: 800\n", "left"),
        (f"camera_matrix: {K}\ndistortion_coefficients: {D}\nwidth: 1e3\nheight: 800\n", "camera"),
        (NO_SPACES, "camera"),
        (XML, "camera"),
    ],
)
def test_usual_names(text: str, key: str, tmp_path: Path) -> None:
    ((name, imported),) = read(tmp_path / "calibration.txt", text).items()
    assert name == key
    camera = exact(imported)
    assert camera.image_size == (1000, 800)
    agree(camera.project(directions()), expected())


def test_numpys_height_and_width_are_told_by_the_principal_point(tmp_path: Path) -> None:
    matrix = [[900.5, 0, 640.0], [0, 901.5, 355.0], [0, 0, 1]]
    text = json.dumps({"camera_resolution": [720, 1280], "camera_matrix": matrix, "distortion_coefficients": D})
    imported = read(tmp_path / "northstar.json", text)["camera"]
    assert imported.image_size == (1280, 720)
    assert [note.code for note in imported.notes] == ["unverified-convention"]
    portrait = json.dumps({"image_size": [720, 1280], "K": [[900, 0, 360], [0, 900, 640], [0, 0, 1]], "D": D})
    upright = read(tmp_path / "portrait.json", portrait)["camera"]
    assert (upright.image_size, upright.notes) == ((720, 1280), ())


@pytest.mark.parametrize(
    ("flag", "model"), [({"fisheye_model": 1}, "opencv_fisheye"), ({"fisheye": False}, "opencv4"),
                        ({"distortion_model": "equidistant"}, "opencv_fisheye"), ({"model": "plumb_bob"}, "opencv4")]
)  # fmt: skip
def test_four_coefficients_with_a_word_of_which_model(flag: dict[str, object], model: str, tmp_path: Path) -> None:
    text = json.dumps({"K": K, "D": D[:4], "image_size": [1000, 800], **flag})
    camera = exact(read(tmp_path / "a.json", text)["camera"])
    assert camera.model == model
    truth = opencv_fisheye if model == "opencv_fisheye" else opencv
    agree(camera.project(directions()), truth(directions(), [900.5, 901.5, 502.0, 398.5], D[:4]))


def test_four_coefficients_without_it_are_two_readings(tmp_path: Path) -> None:
    cameras = read(tmp_path / "a.json", json.dumps({"K": K, "D": D[:4], "image_size": [1000, 800], "model": "C920"}))
    assert list(cameras) == ["opencv4", "opencv_fisheye"]
    with pytest.raises(InputError, match="does not say of which model"):
        pick(cameras)


def test_skew_is_in_the_way(tmp_path: Path) -> None:
    skewed = [[900.5, 1.5, 502.0], *K[1:]]
    imported = read(tmp_path / "a.json", json.dumps({"K": skewed, "D": D, "image_size": [1000, 800]}))["camera"]
    with pytest.raises(NotExactError, match=r"skew = 1.5 px"):
        exact(imported)
    plain = expected()
    plain[:, 0] += 1.5 * (plain[:, 1] - 398.5) / 901.5
    agree(imported.project(directions()), plain)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"K": [[1, 0, 5], [0, 1, 5], [0, 0, 2]]}, "no camera matrix"),
        ({"K": [[-1, 0, 5], [0, 1, 5], [0, 0, 1]]}, "focal lengths must be positive"),
        ({"K": [[1, 0, 5], [0, float("nan"), 5], [0, 0, 1]]}, "not a finite number"),
        ({"D": [1, 2, 3]}, "3 distortion coefficients, expected 0, 4, 5, 8, 12 or 14"),
        ({"D": [*D, 0, 0, 0], "fisheye": True}, "8 distortion coefficients, expected 4"),
        ({"D": {"rows": 5, "cols": 1, "data": [0] * 12}}, "said to be 5x1, but has 12 numbers"),
        ({"image_size": [1000.5, 800]}, "not a whole number"),
        ({"image_size": [0, 800]}, "positive whole numbers"),
    ],
)
def test_refused(change: dict[str, object], message: str, tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"K": K, "D": D, "image_size": [1000, 800], **change}))
    with pytest.raises(FileFormatError, match=message):
        FORMAT.read(path)


def test_no_coefficients_is_not_taken_for_none(tmp_path: Path) -> None:
    path = tmp_path / "a.json"
    path.write_text(json.dumps({"K": K, "distorsion": D, "image_size": [1000, 800]}))
    assert not FORMAT.recognises(path)
    with pytest.raises(FileFormatError, match="no camera matrix with distortion coefficients"):
        FORMAT.read(path)


def test_real_files(data_dir: Path) -> None:
    """As cv2 reads them; where the size is missing, it is asked for."""
    folder = data_dir / "formats" / "opencv"
    for path in sorted(folder.iterdir()):
        assert FORMAT.recognises(path), path
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_READ)
        stereo = not storage.getNode("M1").empty()
        keys = (
            [("1", "M1", "D1"), ("2", "M2", "D2")]
            if stereo
            else [("camera", "camera_matrix", "distortion_coefficients")]
        )
        cameras = FORMAT.read(path)
        assert list(cameras) == [key for key, _, _ in keys]
        for key, matrix, distortion in keys:
            imported = cameras[key]
            assert (imported.image_size == (640, 480)) == (path.name == "left_intrinsics.yml")
            camera = exact(imported if imported.resize is None else imported.resize((640, 480)))
            np.testing.assert_array_equal(camera.matrix, storage.getNode(matrix).mat())
            np.testing.assert_array_equal(camera.distortion, storage.getNode(distortion).mat().ravel())


@pytest.mark.parametrize(
    ("content", "names"),
    [
        (
            {"cameras": [{"K": K, "dist": D}, {"K": K, "dist": D}], "image_size": [1000, 800]},
            ["cameras.0", "cameras.1"],
        ),
        ({"calibration": {"result": {"mtx": K, "dist": D}, "img_size": [1000, 800]}}, ["calibration.result"]),
        (
            {
                "resolution": {"width": 1000.0, "height": 800.0},
                "cameraIntrinsics": {"rows": 3, "cols": 3, "type": 6, "data": FLAT},
                "distCoeffs": {"rows": 1, "cols": 5, "type": 6, "data": D},
                "lensmodel": "LENSMODEL_OPENCV",
            },
            ["camera"],
        ),
    ],
)
def test_cameras_deep_in_a_home_made_file(content: object, names: list[str], tmp_path: Path) -> None:
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps(content))
    assert recognise(path, installed().camera_formats).name == "opencv"
    cameras = FORMAT.read(path)
    assert list(cameras) == names
    for imported in cameras.values():
        camera = exact(imported)
        assert camera.image_size == (1000, 800)
        assert camera.params.tolist() == [900.5, 901.5, 502.0, 398.5, *D]
