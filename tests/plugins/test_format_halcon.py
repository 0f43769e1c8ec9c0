"""HALCON: in metres, and what is projected is corrected to where it came from."""

from pathlib import Path

import numpy as np
import pytest
from format_files_robotics import HALCON
from format_truth import agree, directions, opencv
from opencsp_calib_formats.halcon import Halcon

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact, fitted

FOCUS, PITCH, CENTRE = 9e-3, 1e-5, np.array([502.0, 398.5])


def read(tmp_path: Path, text: str):
    path = tmp_path / "campar.dat"
    path.write_text(text)
    assert Halcon().recognises(path)
    return Halcon().read(path)["camera"]


def with_entries(**entries: float) -> str:
    lines = [line for line in HALCON.decode().split("\n") if not line.startswith("Kappa")]
    return "\n".join([*lines[:3], *(f"{key}:{key.lower()}:  {value:e};" for key, value in entries.items()), *lines[3:]])


def measured_metres(pixels: np.ndarray) -> np.ndarray:
    return (pixels - CENTRE) * PITCH


def test_without_distortion_it_is_a_pinhole(tmp_path: Path) -> None:
    camera = exact(read(tmp_path, with_entries(Kappa=0.0)))
    agree(camera.project(directions()), opencv(directions(), (900, 900, 502, 398.5)))


def test_division(tmp_path: Path) -> None:
    imported = read(tmp_path, HALCON.decode())
    with pytest.raises(NotExactError, match="Kappa = -1200"):
        exact(imported)
    points = directions(30)
    measured = measured_metres(imported.project(points))
    corrected = measured / (1 - 1200 * (measured**2).sum(axis=1))[:, None]
    agree(corrected / FOCUS, points[:, :2] / points[:, 2:], 1e-12)
    assert fitted(imported, "opencv8").worst_px < 1e-4


def test_polynomial(tmp_path: Path) -> None:
    k1, k2, k3, p1, p2 = 800.0, -2e6, 1e9, 0.02, -0.03
    imported = read(tmp_path, with_entries(Poly1=k1, Poly2=k2, Poly3=k3, Poly4=p1, Poly5=p2))
    with pytest.raises(NotExactError, match="Poly1 = 800"):
        exact(imported)
    points = directions(25)
    u, v = measured_metres(imported.project(points)).T
    r2 = u * u + v * v
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    x = u * radial + p1 * (r2 + 2 * u * u) + 2 * p2 * u * v
    y = v * radial + 2 * p1 * u * v + p2 * (r2 + 2 * v * v)
    agree(np.column_stack([x, y]) / FOCUS, points[:, :2] / points[:, 2:], 1e-12)
    assert [note.code for note in imported.notes] == ["unverified-convention"]


def test_layout_example(data_dir: Path) -> None:
    (imported,) = Halcon().read(data_dir / "formats" / "misc_halcon" / "halcon_polynomial_layout.dat").values()
    assert imported.image_size == (1944, 1200)
    centre = imported.project(np.array([[0.0, 0.0, 1.0]]))
    np.testing.assert_allclose(centre, [[971.5, 599.5]])
    slope = (imported.project(np.array([[1e-6, 0.0, 1.0]])) - centre)[0, 0] / 1e-6
    assert slope == pytest.approx(8e-3 / 4.5e-6, rel=1e-6)


def test_camera_types(tmp_path: Path) -> None:
    text = HALCON.decode() + 'CamType:camtype: "{}";\n'
    assert read(tmp_path, text.format("area_scan_division")).project is not None
    with pytest.raises(NotExactError, match="line_scan_division"):
        exact(read(tmp_path, text.format("line_scan_division")))


@pytest.mark.parametrize("key", ["Magnification", "Tilt", "Vx"])
def test_other_cameras_are_refused_by_name(tmp_path: Path, key: str) -> None:
    with pytest.raises(NotExactError, match=key):
        exact(read(tmp_path, with_entries(**{key: 0.1})))


@pytest.mark.parametrize(
    "text",
    [
        HALCON.decode().replace("9.0e-03", "-9.0e-03"),
        HALCON.decode().replace("1.0e-05", "0"),
        HALCON.decode().replace("Cx:", "Cz:"),
        with_entries(Kappa=1.0, Poly1=1.0),
        HALCON.decode() + "Cx:cx: 1;\n",
    ],
)
def test_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, text)
