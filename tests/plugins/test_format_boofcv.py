"""BoofCV: OpenCV's formulas half a pixel off, with the convention flagged."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from format_truth import agree, directions, opencv, opencv_fisheye, perspective
from opencsp_calib_formats.boofcv import BoofCV

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

K = (900.5, 901.5, 502.0, 398.5)


def yaml(model: str, skew: float = 0.0, more: str = "") -> str:
    pinhole = f"fx: 900.5\n  fy: 901.5\n  cx: 502.5\n  cy: 399.0\n  width: 1000\n  height: 800\n  skew: {skew}\n"
    return f"# comment\npinhole:\n  {pinhole}model: {model}\n{more}"


def radial(*k: float, t1: float = 1e-3, t2: float = -2e-3) -> str:
    listed = "".join(f"  - {value}\n" for value in k)
    return f"radial_tangential:\n  radial:\n{listed}  t1: {t1}\n  t2: {t2}\n"


def read(tmp_path: Path, text: str):
    path = tmp_path / "intrinsic.yaml"
    path.write_text(text)
    assert BoofCV().recognises(path)
    return BoofCV().read(path)


def one(tmp_path: Path, text: str):
    imported = read(tmp_path, text)["camera"]
    assert [note.code for note in imported.notes] == ["unverified-convention"]
    assert "0.5 px" in imported.notes[0].message
    return imported


def test_real_files(data_dir: Path) -> None:
    (mono,) = BoofCV().read(data_dir / "formats" / "boofcv" / "mono_intrinsic.yaml").values()
    expected = [701.0116882676376, 698.6537946928421, 308.4551818095542 - 0.5, 246.84300560315452 - 0.5]
    expected += [-0.25559248570886445, 0.09997127476560613, 0, 0]
    np.testing.assert_allclose(exact(mono).params, expected, rtol=1e-15)
    (omni,) = BoofCV().read(data_dir / "formats" / "boofcv" / "omni_fisheye.yaml").values()
    with pytest.raises(NotExactError, match=r"mirror_offset = 1\.133"):
        exact(omni)
    k = np.array([[398.77492706579216, 0, 318.67879590584187], [0, 398.7685638672075, 319.21743712432686], [0, 0, 1]])
    d = np.array([-0.24972089525362837, 0.009672326567075125, 0, 0])
    points = directions(80)
    expected, _ = cv2.omnidir.projectPoints(points[:, None], np.zeros(3), np.zeros(3), k, 1.1331346732794045, d)
    agree(omni.project(points), expected[:, 0])


@pytest.mark.parametrize("k", [(), (-0.1,), (-0.1, 0.02), (-0.1, 0.02, -0.003), (-0.1, 0.02, -0.003, 0.0)])
def test_up_to_three_radial_terms_are_exact(tmp_path: Path, k: tuple) -> None:
    camera = exact(one(tmp_path, yaml("pinhole_radial_tangential", more=radial(*k))))
    k1, k2, k3 = (*k, 0, 0, 0)[:3]
    agree(camera.project(directions()), opencv(directions(), K, (k1, k2, 1e-3, -2e-3, k3)))


def test_a_fourth_term_and_skew_are_in_the_way(tmp_path: Path) -> None:
    imported = one(tmp_path, yaml("pinhole_radial_tangential", 1.5, radial(-0.1, 0.02, -0.003, 0.01, t1=0, t2=0)))
    with pytest.raises(NotExactError, match=r"skew.*4 radial"):
        exact(imported)
    x, y = perspective(directions())
    r = np.hypot(x, y)
    scale = 1 - 0.1 * r**2 + 0.02 * r**4 - 0.003 * r**6 + 0.01 * r**8
    x, y = x * scale, y * scale
    agree(imported.project(directions()), np.column_stack([K[0] * x + 1.5 * y + K[2], K[1] * y + K[3]]))


def test_pinhole(tmp_path: Path) -> None:
    camera = exact(one(tmp_path, yaml("pinhole")))
    assert camera.model == "pinhole"
    agree(camera.project(directions()), opencv(directions(), K))


SYMMETRIC = "symmetric:\n- 0.5\n- 0.005\n- -0.01\n- 0.0005\n- -0.0001\n"


def test_kannala_brandts_first_coefficient_multiplies_the_angle(tmp_path: Path) -> None:
    imported = one(tmp_path, yaml("kannala_brandt", more=SYMMETRIC + "radial: []\ntangent: []\nradial_trig: []\n"))
    d = (0.01, -0.02, 1e-3, -2e-4)
    expected = opencv_fisheye(directions(80), (K[0] / 2, K[1] / 2, *K[2:]), d)
    agree(exact(imported).project(directions(80)), expected)
    x, y = perspective(directions(80))
    r = np.where(np.hypot(x, y) > 0, np.hypot(x, y), 1)
    theta = np.arctan(r)
    by_boofcv = (0.5 * theta + 0.005 * theta**3 - 0.01 * theta**5 + 0.0005 * theta**7 - 0.0001 * theta**9) / r
    expected = np.column_stack([K[0] * x * by_boofcv + K[2], K[1] * y * by_boofcv + K[3]])
    agree(exact(imported).project(directions(80)), expected)


@pytest.mark.parametrize("more", ["radial:\n- 0.1\n", "tangent:\n- 0.1\n"])
def test_asymmetric_terms_are_refused_by_name(tmp_path: Path, more: str) -> None:
    with pytest.raises(NotExactError, match=more.split(":")[0]):
        exact(one(tmp_path, yaml("kannala_brandt", more=SYMMETRIC + more)))


def test_a_sixth_symmetric_term_is_in_the_way(tmp_path: Path) -> None:
    imported = one(tmp_path, yaml("kannala_brandt", more=SYMMETRIC + "- 0.00002\n"))
    with pytest.raises(NotExactError, match="6 symmetric"):
        exact(imported)
    assert np.isfinite(imported.project(directions(80))).all()


def test_stereo_pair(tmp_path: Path) -> None:
    def inside(name: str, f: float) -> str:
        pinhole = f"fx: {f}, fy: {f}, cx: 500.5, cy: 400.5, width: 1000, height: 800, skew: 0.0"
        lens = "radial_tangential: {radial: [-0.1, 0.02], t1: 0.0, t2: 0.0}"
        return f"{name}:\n  model: pinhole_radial_tangential\n  pinhole:\n    {{{pinhole}}}\n  {lens}\n"

    text = "model: stereo_camera\n" + inside("left", 900) + inside("right", 910)
    cameras = read(tmp_path, text)
    assert {name: exact(imported).params[0] for name, imported in cameras.items()} == {"left": 900, "right": 910}


@pytest.mark.parametrize(
    "text",
    [
        yaml("kannala_brandt"),
        yaml("kannala_brandt", more="symmetric: [0.0, 1.0]\n"),
        yaml("pinhole").replace("fx: 900.5", "fx: -900.5"),
        yaml("pinhole").replace("width: 1000", "width: 0"),
        yaml("pinhole_radial_tangential", more=radial(0.1).replace("0.1", "a")),
    ],
)
def test_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, text)


def test_an_unheard_of_model_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(NotExactError, match="unheard_of"):
        exact(one(tmp_path, yaml("unheard_of")))
