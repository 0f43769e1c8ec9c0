"""Kalibr: its documented projections, written out here, and OpenCV where they are OpenCV's."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from format_truth import agree, directions, opencv, opencv_fisheye
from opencsp_calib_formats.kalibr import Kalibr

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact, fitted, pick
from opencsp_calib.interfaces import Imported

CORE = [400.5, 401.5, 502.0, 398.5]
D = [-0.1, 0.02, 0.001, -0.002]


def read(path: Path, model: str, shape: list[float], distortion: str, d: list[float], head: str = "") -> Imported:
    """A chain as Kalibr writes it: block sequences at the indentation of their key."""
    path.write_text(f"""{head}cam0:
  T_cam_imu:
  - [1.0, 0.0, 0.0, 0.0]
  - [0.0, 1.0, 0.0, 0.0]
  cam_overlaps: []
  camera_model: {model}
  distortion_coeffs: {d}
  distortion_model: {distortion}
  intrinsics: {[*shape, *CORE]}
  resolution: [1000, 800]
  rostopic: /cam0/image_raw
""")
    assert Kalibr().recognises(path)
    return Kalibr().read(path)["cam0"]


@pytest.mark.parametrize("head", ["", "%YAML:1.0 # OpenVINS\n"])
def test_pinholes_are_opencvs(head: str, tmp_path: Path) -> None:
    path = tmp_path / "camchain.yaml"
    radtan = exact(read(path, "pinhole", [], "radtan", D, head))
    agree(radtan.project(directions()), opencv(directions(), CORE, D))
    equidistant = exact(read(path, "pinhole", [], "equidistant", D, head))
    agree(equidistant.project(directions()), opencv_fisheye(directions(), CORE, D))
    bare = exact(read(path, "pinhole", [], "none", [], head))
    assert (bare.model, bare.image_size) == ("pinhole", (1000, 800))
    assert exact(read(path, "omni", [0.0], "radtan", D, head)) == radtan


def formula(model: str, shape: list[float], distortion: str, d: list[float]):
    x, y, z = directions(80 if distortion == "none" else 40).T
    norm = np.sqrt(x**2 + y**2 + z**2)
    if model == "ds":
        xi, alpha = shape
        z = alpha * np.sqrt(x**2 + y**2 + (xi * norm + z) ** 2) + (1 - alpha) * (xi * norm + z)
    elif model == "eucm":
        alpha, beta = shape
        z = alpha * np.sqrt(beta * (x**2 + y**2) + z**2) + (1 - alpha) * z
    elif model == "omni":
        z = z + shape[0] * norm
    x, y = x / z, y / z
    r2 = x**2 + y**2
    if distortion == "fov":
        r = np.sqrt(r2)
        scale = np.arctan(2 * r * np.tan(d[0] / 2)) / (d[0] * np.where(r > 0, r, 1))
        scale[r == 0] = 0
        x, y = x * scale, y * scale
    elif distortion == "radtan":
        radial = 1 + d[0] * r2 + d[1] * r2**2
        x, y = (
            x * radial + 2 * d[2] * x * y + d[3] * (r2 + 2 * x**2),
            y * radial + d[2] * (r2 + 2 * y**2) + 2 * d[3] * x * y,
        )
    return np.column_stack([CORE[0] * x + CORE[2], CORE[1] * y + CORE[3]])


@pytest.mark.parametrize(
    ("model", "shape", "distortion", "d", "obstacle", "fit"),
    [
        ("ds", [-0.2, 0.59], "none", [], "xi = -0.2", "opencv_fisheye"),
        ("eucm", [0.6, 1.07], "none", [], "alpha = 0.6", "opencv_fisheye"),
        ("omni", [1.1], "none", [], "xi = 1.1", "opencv_fisheye"),
        ("omni", [0.9], "radtan", [-0.1, 0.02, 0.0, 0.0], "xi = 0.9", "opencv_fisheye"),
        ("pinhole", [], "fov", [0.93], "w = 0.93", "opencv_fisheye"),
    ],
)
def test_the_others_are_refused_and_offered_for_a_fit(
    model: str, shape: list[float], distortion: str, d: list[float], obstacle: str, fit: str, tmp_path: Path
) -> None:
    imported = read(tmp_path / "camchain.yaml", model, shape, distortion, d)
    with pytest.raises(NotExactError, match=f"{obstacle}.*--fit MODEL"):
        exact(imported)
    rays = directions(80 if distortion == "none" else 40)
    agree(imported.project(rays), formula(model, shape, distortion, d), 1e-9)
    found = fitted(imported, fit, 1.0, max_angle=np.radians(95))
    assert found.worst_px < 0.1


def test_double_sphere_fit_costs_what_was_measured(data_dir: Path) -> None:
    """To 95 degrees the double sphere of the real chain is a Kannala-Brandt to about 0.0008 px rms, 0.0024 worst."""
    cameras = Kalibr().read(data_dir / "formats" / "kalibr" / "camchain_ds_stereo.yaml")
    found = fitted(cameras["cam0"], "opencv_fisheye", max_angle=np.radians(95))
    assert found.rms_px < 0.002
    assert found.worst_px < 0.01


def test_real_chains(data_dir: Path) -> None:
    folder = data_dir / "formats" / "kalibr"
    stereo = Kalibr().read(folder / "camchain_ds_stereo.yaml")
    with pytest.raises(InputError, match="cam0, cam1"):
        pick(stereo)
    assert stereo["cam1"].image_size == (1440, 1080)
    camera = exact(Kalibr().read(folder / "camchain_pinhole_radtan.yaml")["cam0"])
    content = yaml.safe_load((folder / "camchain_pinhole_radtan.yaml").read_text())["cam0"]
    agree(camera.project(directions()), opencv(directions(), content["intrinsics"], content["distortion_coeffs"]))


@pytest.mark.parametrize("model", ["pinhole", "opencv4", "opencv_fisheye"])
def test_written_and_read_to_the_last_bit(model: str, tmp_path: Path) -> None:
    d = [] if model == "pinhole" else [1e-5 / 3, 1e-300, -0.1, 0.0]
    camera = Camera("a", model, np.array([1000 / 3, 1e3, 502.1, 398.7, *d]), (1000, 800))
    path = tmp_path / "camchain.yaml"
    Kalibr().write({"a": camera}, path)
    content = yaml.safe_load(path.read_text())["cam0"]
    assert content["intrinsics"] == camera.params[:4].tolist()
    assert content["distortion_coeffs"] == d
    assert np.array_equal(exact(Kalibr().read(path)["cam0"]).params, camera.params)


def test_a_model_with_too_much_is_not_written(tmp_path: Path) -> None:
    camera = Camera("a", "opencv5", np.array([*CORE, *D, 0.0]), (1000, 800))
    Kalibr().write({"a": camera}, tmp_path / "a.yaml")  # k3 is nothing
    with pytest.raises(InputError, match=r"k3 = 0.3 is in the way"):
        Kalibr().write({"a": Camera("a", "opencv5", np.array([*CORE, *D, 0.3]), (9, 9))}, tmp_path / "b.yaml")
    with pytest.raises(InputError, match="transforms between its cameras"):
        Kalibr().write({"a": camera, "b": camera}, tmp_path / "b.yaml")


@pytest.mark.parametrize(
    ("model", "shape", "distortion", "d", "message"),
    [
        ("omni", [0.9], "equidistant", D, "omni with equidistant: Kalibr has no such camera"),
        ("ds", [0.5], "none", [], "has 5 numbers, expected 6"),
        ("ds", [0.5, 1.5], "none", [], "no camera of the model ds"),
        ("eucm", [0.5, -1.0], "none", [], "no camera of the model eucm"),
        ("pinhole", [], "radtan", [0.1], "has 1 number, expected 4"),
        ("pinhole", [], "fov", [9.0], "no angle below pi"),
    ],
)
def test_refused(model: str, shape: list[float], distortion: str, d: list[float], message: str, tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match=message):
        read(tmp_path / "camchain.yaml", model, shape, distortion, d)
