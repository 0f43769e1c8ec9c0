"""camodocal and VINS: OpenCV, its omnidirectional module, and Scaramuzza's formula."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from format_files_robotics import CAMODOCAL
from format_truth import agree, directions, opencv, opencv_fisheye
from opencsp_calib_formats.camodocal import Camodocal

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact


def yaml(kind: str, **groups: dict) -> str:
    lines = ["%YAML:1.0", "---", f"model_type: {kind}", "camera_name: cam7", "image_width: 1000", "image_height: 800"]
    for name, values in groups.items():
        lines += [f"{name}:", *(f"   {key}: {value!r}" for key, value in values.items())]
    return "\n".join(lines) + "\n"


def read(tmp_path: Path, text: str):
    path = tmp_path / "camera.yaml"
    path.write_text(text)
    assert Camodocal().recognises(path)
    (imported,) = Camodocal().read(path).values()
    return imported


RADTAN = {"k1": -0.1, "k2": 0.02, "p1": 1e-3, "p2": -2e-3}
PINHOLE = {"fx": 900.5, "fy": 901.5, "cx": 502.0, "cy": 398.5}


def test_real_pinhole(data_dir: Path) -> None:
    (imported,) = Camodocal().read(data_dir / "formats" / "camodocal_vins" / "euroc_config.yaml").values()
    camera = exact(imported)
    np.testing.assert_array_equal(camera.params, [461.6, 460.3, 363, 248.1, -0.2917, 0.08228, 5.333e-5, -1.578e-4])
    assert camera.image_size == (752, 480)


def test_real_mei_equals_opencvs_omnidirectional_module(data_dir: Path) -> None:
    (imported,) = Camodocal().read(data_dir / "formats" / "camodocal_vins" / "3dm_config.yaml").values()
    with pytest.raises(NotExactError, match=r"xi = 2\.057"):
        exact(imported)
    points = directions(60)
    k, d = np.array([[1115.0, 0, 367.2], [0, 1114, 238.5], [0, 0, 1]]), np.array([0.07145, 0.5059, 4.727e-5, -5.492e-4])
    expected, _ = cv2.omnidir.projectPoints(points[:, None], np.zeros(3), np.zeros(3), k, 2.057, d)
    agree(imported.project(points), expected[:, 0])


def test_mei_without_mirror_is_a_pinhole(tmp_path: Path) -> None:
    imported = read(tmp_path, CAMODOCAL.decode().replace("xi: 1.2", "xi: 0."))
    agree(
        exact(imported).project(directions()), opencv(directions(), (900.5, 901.5, 502, 398.5), list(RADTAN.values()))
    )


def test_kannala_brandts_k2_is_opencvs_k1(tmp_path: Path) -> None:
    k = {"k2": 0.01, "k3": -0.02, "k4": 1e-3, "k5": -2e-4}
    text = yaml("kannala_brandt", projection_parameters={**k, "mu": 400.0, "mv": 401.0, "u0": 502.0, "v0": 398.5})
    expected = opencv_fisheye(directions(80), (400, 401, 502, 398.5), list(k.values()))
    agree(exact(read(tmp_path, text)).project(directions(80)), expected)


def test_kannala_brandt_as_converters_from_kalibr_write_it(tmp_path: Path) -> None:
    k, m = {"k2": 0.01, "k3": -0.02, "k4": 1e-3, "k5": -2e-4}, {"mu": 400.0, "mv": 401.0, "u0": 502.0, "v0": 398.5}
    camera = exact(read(tmp_path, yaml("KANNALA_BRANDT", distortion_parameters=k, projection_parameters=m)))
    np.testing.assert_array_equal(camera.params, [*m.values(), *k.values()])


def test_pinhole_full_has_opencvs_eight_coefficients(tmp_path: Path) -> None:
    d = {**RADTAN, "k3": 1e-3, "k4": 0.2, "k5": 0.03, "k6": 1e-3}
    imported = read(tmp_path, yaml("PINHOLE_FULL", distortion_parameters=d, projection_parameters=PINHOLE))
    expected = opencv(directions(), list(PINHOLE.values()), list(d.values()))
    agree(exact(imported).project(directions()), expected)


def test_scaramuzza_by_its_formula(tmp_path: Path) -> None:
    inverse = {f"p{i}": c for i, c in enumerate((378.7, 248.0, 9.76, 14.7, 22.4, 8.4))}
    affine = {"ac": 0.999, "ad": -0.002, "ae": 0.003, "cx": 605.9, "cy": 362.4}
    text = yaml("scaramuzza", poly_parameters={"p0": -246.0}, inv_poly_parameters=inverse, affine_parameters=affine)
    points = directions(80)[1:]
    norm = np.hypot(points[:, 0], points[:, 1])
    theta = np.arctan2(-points[:, 2], norm)
    rho = sum(c * theta**i for i, c in enumerate(inverse.values()))
    xn, yn = points[:, :2].T / np.where(norm > 0, norm, 1) * rho
    expected = np.column_stack([xn * 0.999 + yn * -0.002 + 605.9, xn * 0.003 + yn + 362.4])
    imported = read(tmp_path, text)
    ours = imported.project(points)
    outside = norm > 0.2
    agree(ours[outside], expected[outside])
    with pytest.raises(NotExactError, match="Scaramuzza"):
        exact(imported)


@pytest.mark.parametrize("kind", ["EUCM", "UNHEARD_OF"])
def test_other_models_are_refused_by_name(tmp_path: Path, kind: str) -> None:
    with pytest.raises(NotExactError, match=kind):
        exact(read(tmp_path, yaml(kind)))


@pytest.mark.parametrize(
    "text",
    [
        yaml("PINHOLE"),
        yaml("PINHOLE", projection_parameters={**PINHOLE, "fx": -1.0}),
        yaml("PINHOLE", projection_parameters=PINHOLE, distortion_parameters={"k1": 0.1}),
        yaml("PINHOLE", projection_parameters=PINHOLE).replace("image_width", "width"),
        yaml("PINHOLE", projection_parameters=PINHOLE).replace("image_width: 1000", "image_width: 0"),
        yaml("scaramuzza", inv_poly_parameters={"p1": 1.0}),
    ],
)
def test_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, text)
