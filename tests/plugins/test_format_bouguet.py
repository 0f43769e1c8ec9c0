"""Bouguet's toolbox: its documented formula against the reader."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from format_truth import agree, directions, perspective
from matlab_files import structures
from opencsp_calib_formats.bouguet import Bouguet

from opencsp_calib.errors import FileFormatError, InputError, NotExactError
from opencsp_calib.importing import exact, pick
from opencsp_calib.interfaces import Imported

KC = (-0.1, 0.02, 0.001, -0.002, -0.003)
M = """% Intrinsic and Extrinsic Camera Parameters
%-- Focal length:
fc = [ 900.500000000000000 ; 901.500000000000000 ];

%-- Principal point:
cc = [ 502.000000000000000 ; 398.500000000000000 ];
%-- Skew coefficient:
alpha_c = 0.000000000000000;
%-- Distortion coefficients:
kc = [ -0.1 ; 0.02 ; 0.001 ; -0.002 ; -0.003 ];
%-- Focal length uncertainty:
fc_error = [ NaN ; NaN ];
nx = 1000;
ny = 800;
n_ima = 2;
omc_1 = [ NaN ; NaN ; NaN ];
"""


def read(path: Path, data: bytes) -> Mapping[str, Imported]:
    path.write_bytes(data)
    assert Bouguet().recognises(path)
    return Bouguet().read(path)


def formula(alpha: float = 0.0, kc=KC):
    """The toolbox's description of the calibration parameters; its pixels are counted from 0."""
    x, y = perspective(directions())
    r2 = x**2 + y**2
    radial = 1 + kc[0] * r2 + kc[1] * r2**2 + kc[4] * r2**3
    xd = radial * x + 2 * kc[2] * x * y + kc[3] * (r2 + 2 * x**2)
    yd = radial * y + kc[2] * (r2 + 2 * y**2) + 2 * kc[3] * x * y
    return np.column_stack([900.5 * (xd + alpha * yd) + 502.0, 901.5 * yd + 398.5])


def variables(**more: object) -> dict[str, object]:
    column = {"fc": [[900.5], [901.5]], "cc": [[502.0], [398.5]], "kc": np.array(KC)[:, None]}
    return {**column, "alpha_c": 0.0, "nx": np.uint16(1000), "ny": np.uint16(800), "X_1": np.zeros((3, 9)), **more}


@pytest.mark.parametrize(("name", "data"), [("a.m", M.encode()), ("a.mat", structures(variables()))])
def test_equals_the_toolboxs_formula(name: str, data: bytes, tmp_path: Path) -> None:
    camera = exact(read(tmp_path / name, data)["camera"])
    assert camera.image_size == (1000, 800)
    agree(camera.project(directions()), formula())


def test_skew_is_in_the_way(tmp_path: Path) -> None:
    imported = read(tmp_path / "a.mat", structures(variables(alpha_c=0.001)))["camera"]
    with pytest.raises(NotExactError, match="skew"):
        exact(imported)
    agree(imported.project(directions()), formula(0.001))


def test_four_entries_are_of_one_of_two_models(tmp_path: Path) -> None:
    cameras = read(tmp_path / "a.mat", structures(variables(kc=np.array(KC[:4])[:, None])))
    with pytest.raises(InputError, match="choose one with --camera: opencv4, opencv_fisheye"):
        pick(cameras)
    agree(exact(cameras["opencv4"]).project(directions()), formula(kc=(*KC[:4], 0.0)))
    assert exact(cameras["opencv_fisheye"]).model == "opencv_fisheye"
    four = M.replace("; -0.003 ]", "]")
    assert list(read(tmp_path / "b.m", four.encode())) == ["opencv4", "opencv_fisheye"]
    fisheye = read(tmp_path / "c.m", b"% Fisheye model\n" + four.encode())
    assert exact(fisheye["camera"]).model == "opencv_fisheye"


def test_stereo(tmp_path: Path) -> None:
    both = {
        f"{key}{end}": value for end in ("_left", "_right") for key, value in variables().items() if key[0] in "fcka"
    }
    cameras = read(tmp_path / "a.mat", structures({**both, "R": np.eye(3), "nx": 1000.0, "ny": 800.0}))
    assert list(cameras) == ["left", "right"]
    assert exact(cameras["right"]).name == "a right"


def test_without_image_size_it_is_asked_for(tmp_path: Path) -> None:
    imported = read(tmp_path / "a.m", M.replace("nx", "mx").encode())["camera"]
    with pytest.raises(InputError, match="--image-size"):
        exact(imported)


@pytest.mark.parametrize(
    "change", [("fc = [ 900.5", "fc = [ NaN"), ("-0.003 ]", "-0.003 ; 1 ]"), ("= 1000;", "= 0.5;")]
)
def test_refused(change: tuple[str, str], tmp_path: Path) -> None:
    path = tmp_path / "a.m"
    path.write_text(M.replace(*change))
    with pytest.raises(FileFormatError, match=r"a\.m"):
        Bouguet().read(path)
