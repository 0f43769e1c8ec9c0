"""Basalt: formulas written again, and OpenCV where the model is OpenCV's."""

import json
from pathlib import Path

import numpy as np
import pytest
from format_truth import agree, directions, opencv, opencv_fisheye, perspective
from opencsp_calib_formats.basalt import Basalt

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact, fitted

K = {"fx": 380.0, "fy": 381.0, "cx": 502.0, "cy": 398.5}
FX, FY, CX, CY = K.values()


def read(tmp_path: Path, kind: str, **parameters: float):
    camera = {"camera_type": kind, "intrinsics": {**K, **parameters}}
    path = tmp_path / "calibration.json"
    path.write_text(json.dumps({"value0": {"intrinsics": [camera], "resolution": [[1000, 800]]}}))
    assert Basalt().recognises(path)
    return Basalt().read(path)["0"]


def pixels(x, y):
    return np.column_stack([FX * x + CX, FY * y + CY])


def test_exact_models(tmp_path: Path) -> None:
    k = {"k1": 0.01, "k2": -0.02, "k3": 1e-3, "k4": -2e-4}
    fisheye = exact(read(tmp_path, "kb4", **k))
    agree(fisheye.project(directions(80)), opencv_fisheye(directions(80), list(K.values()), list(k.values())))
    agree(exact(read(tmp_path, "pinhole")).project(directions()), opencv(directions(), list(K.values())))
    d = dict(
        zip(
            ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"),
            (0.1, 0.02, 1e-3, -2e-3, 1e-3, 0.2, 0.03, 1e-3),
            strict=True,
        )
    )
    radtan = exact(read(tmp_path, "pinhole-radtan8", **d, rpmax=2.5))
    agree(radtan.project(directions()), opencv(directions(), list(K.values()), list(d.values())))


def test_double_sphere_of_a_real_file(data_dir: Path) -> None:
    cameras = Basalt().read(data_dir / "formats" / "basalt" / "tumvi_512_ds_calib.json")
    assert list(cameras) == ["0", "1"]
    points = directions(90)
    x, y, z = points.T
    xi, alpha = -0.17213086034353243, 0.5931177593944744
    d1 = np.sqrt(x**2 + y**2 + z**2)
    d2 = np.sqrt(x**2 + y**2 + (xi * d1 + z) ** 2)
    n = alpha * d2 + (1 - alpha) * (xi * d1 + z)
    u, v = 158.28600034966977 * x / n + 254.96116578191653, 158.2743455478755 * y / n + 256.8894394501779
    agree(cameras["0"].project(points), np.column_stack([u, v]))
    with pytest.raises(NotExactError, match=r"xi = -0\.17.*alpha = 0\.59"):
        exact(cameras["0"])
    found = fitted(cameras["0"], "opencv_fisheye", max_angle=np.radians(80))
    assert found.worst_px < 2e-3
    assert found.camera.image_size == (512, 512)


def test_enhanced_unified_of_a_real_file(data_dir: Path) -> None:
    imported = Basalt().read(data_dir / "formats" / "basalt" / "tumvi_512_eucm_calib.json")["0"]
    x, y, z = directions(85).T
    alpha, beta = 0.6291060881178562, 1.0418067381860868
    n = alpha * np.sqrt(beta * (x**2 + y**2) + z**2) + (1 - alpha) * z
    u, v = 191.14799836282189 * x / n + 254.9585771534443, 191.13150963902818 * y / n + 256.88154645599448
    agree(imported.project(directions(85)), np.column_stack([u, v]))


def test_unified_and_field_of_view(tmp_path: Path) -> None:
    x, y, z = directions(85).T
    n = 0.6 * np.sqrt(x**2 + y**2 + z**2) + 0.4 * z
    agree(read(tmp_path, "ucm", alpha=0.6).project(directions(85)), pixels(x / n, y / n))
    x, y = perspective(directions(60)[1:])
    r = np.hypot(x, y)
    scale = np.divide(
        np.arctan(2 * r * np.tan(0.465)) / 0.93, r, out=np.full_like(r, 2 * np.tan(0.465) / 0.93), where=r > 0
    )
    agree(read(tmp_path, "fov", w=0.93).project(directions(60)[1:]), pixels(x * scale, y * scale))


@pytest.mark.parametrize("kind", ["bal", "unheard_of"])
def test_other_types_are_refused_by_name(tmp_path: Path, kind: str) -> None:
    with pytest.raises(NotExactError, match=kind):
        exact(read(tmp_path, kind))


@pytest.mark.parametrize(
    ("kind", "parameters"),
    [
        ("ds", {"xi": -1.0, "alpha": 0.5}),
        ("ds", {"xi": 0.1, "alpha": 1.5}),
        ("eucm", {"alpha": 0.5, "beta": 0.0}),
        ("fov", {"w": 4.0}),
        ("ds", {"xi": 0.1}),
        ("kb4", {"fx": -1.0, "k1": 0, "k2": 0, "k3": 0, "k4": 0}),
    ],
)
def test_refused(tmp_path: Path, kind: str, parameters: dict) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, kind, **parameters)
