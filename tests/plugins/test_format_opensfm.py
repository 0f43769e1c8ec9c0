"""OpenSfM and ODM against the documented normalisation, by hand and with OpenCV."""

import json
from pathlib import Path

import numpy as np
import pytest
from format_truth import agree, directions, opencv, opencv_fisheye, perspective
from opencsp_calib_formats.opensfm import OpenSfM

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

W, H = 1000, 800
CENTRED = {"focal_x": 0.9, "focal_y": 0.91, "c_x": 0.01, "c_y": -0.02}
FX, FY, CX, CY = 900.0, 910.0, 0.01 * 1000 + 499.5, -0.02 * 1000 + 399.5


def read(tmp_path: Path, content: object, name: str = "cameras.json"):
    path = tmp_path / name
    path.write_text(json.dumps(content))
    assert OpenSfM().recognises(path)
    return OpenSfM().read(path)


def camera_of(tmp_path: Path, kind: str, **fields: float):
    return read(tmp_path, {"a": {"projection_type": kind, "width": W, "height": H, **fields}})["a"]


PINHOLES = {
    "perspective": ({"focal": 0.9, "k1": -0.1, "k2": 0.02}, (FX, FX, 499.5, 399.5), (-0.1, 0.02, 0, 0)),
    "simple_radial": ({**CENTRED, "k1": -0.1}, (FX, FY, CX, CY), (-0.1, 0, 0, 0)),
    "radial": ({**CENTRED, "k1": -0.1, "k2": 0.02}, (FX, FY, CX, CY), (-0.1, 0.02, 0, 0)),
    "brown": (
        {**CENTRED, "k1": -0.1, "k2": 0.02, "p1": 1e-3, "p2": -2e-3, "k3": -3e-3},
        (FX, FY, CX, CY),
        (-0.1, 0.02, 1e-3, -2e-3, -3e-3),
    ),
}


@pytest.mark.parametrize("kind", PINHOLES)
def test_perspective_types(tmp_path: Path, kind: str) -> None:
    fields, intrinsics, d = PINHOLES[kind]
    camera = exact(camera_of(tmp_path, kind, **fields))
    agree(camera.project(directions()), opencv(directions(), intrinsics, d))


@pytest.mark.parametrize(
    ("kind", "fields", "intrinsics", "d"),
    [
        ("fisheye", {"focal": 0.4, "k1": 0.01, "k2": -0.02}, (400, 400, 499.5, 399.5), (0.01, -0.02, 0, 0)),
        (
            "fisheye_opencv",
            {**CENTRED, "k1": 0.01, "k2": -0.02, "k3": 1e-3, "k4": -2e-4},
            (FX, FY, CX, CY),
            (0.01, -0.02, 1e-3, -2e-4),
        ),
        ("fisheye62", {**CENTRED, "k1": 0.01, "k5": 0.0}, (FX, FY, CX, CY), (0.01, 0, 0, 0)),
    ],
)
def test_fisheyes(tmp_path: Path, kind: str, fields: dict, intrinsics: tuple, d: tuple) -> None:
    camera = exact(camera_of(tmp_path, kind, **fields))
    agree(camera.project(directions(80)), opencv_fisheye(directions(80), intrinsics, d))


def test_fisheye624_by_its_formula(tmp_path: Path) -> None:
    k, p, s = (0.01, -0.02, 1e-3, -2e-4, 1e-4, 1e-5), (1e-3, -2e-3), (2e-3, 1e-3, -1e-3, 5e-4)
    names = [*(f"k{i}" for i in range(1, 7)), "p1", "p2", "s0", "s1", "s2", "s3"]
    fields = dict(zip(names, (*k, *p, *s), strict=True))
    imported = camera_of(tmp_path, "fisheye624", **CENTRED, **fields)
    with pytest.raises(NotExactError, match=r"k5 = 0\.0001"):
        exact(imported)
    x, y = perspective(directions(70))
    r = np.where(np.hypot(x, y) > 0, np.hypot(x, y), 1)
    x, y = x * np.arctan(r) / r, y * np.arctan(r) / r
    r2 = x * x + y * y
    radial = 1 + sum(c * r2 ** (i + 1) for i, c in enumerate(k))
    u = x * radial + 2 * p[0] * x * y + p[1] * (r2 + 2 * x * x) + s[0] * r2 + s[1] * r2**2
    v = y * radial + 2 * p[1] * x * y + p[0] * (r2 + 2 * y * y) + s[2] * r2 + s[3] * r2**2
    agree(imported.project(directions(70)), np.column_stack([FX * u + CX, FY * v + CY]))


def test_portrait_is_divided_by_its_height(tmp_path: Path) -> None:
    imported = read(tmp_path, {"a": {"projection_type": "perspective", "width": 800, "height": 1000, "focal": 0.9}})[
        "a"
    ]
    np.testing.assert_allclose(exact(imported).params[:4], [900, 900, 399.5, 499.5])


def test_real_files(data_dir: Path) -> None:
    folder = data_dir / "formats" / "opensfm_odm"
    (brown,) = OpenSfM().read(folder / "odm_cameras_brown.json").values()
    expected = [4090.87558, 4090.87558, 2918.89587, 2130.79793]
    expected += [0.00739029471, -0.0267322748, -0.00242887624, -0.0078586233, -0.011495881]
    np.testing.assert_allclose(exact(brown).params, expected, rtol=1e-8)
    (dji,) = OpenSfM().read(folder / "odm_reconstruction.json").values()
    np.testing.assert_allclose(
        exact(dji).params, [2245.72312, 2245.72312, 1999.5, 1124.5, 0.00522196337, 0.0152023015, 0, 0], rtol=1e-8
    )
    assert brown.notes == dji.notes == ()


GUESS = {"projection_type": "perspective", "width": W, "height": H, "focal": 0.85, "k1": 0.0, "k2": 0.0}


@pytest.mark.parametrize(
    ("content", "name", "guess"),
    [
        ({"v2 dji 1000 800 perspective 0.85": GUESS}, "anything.json", True),
        ({"a": {**GUESS, "focal_prior": 0.85}}, "anything.json", True),
        ({"a": GUESS}, "camera_models.json", True),
        ({"a": GUESS}, "cameras.json", False),
        ([{"cameras": {"v2 dji": {**GUESS, "focal_prior": 0.85}}}], "reconstruction.json", False),
    ],
)
def test_what_opensfm_starts_from_is_no_result(tmp_path: Path, content: object, name: str, guess: bool) -> None:
    (imported,) = read(tmp_path, content, name).values()
    assert [note.code for note in imported.notes] == ["not-a-result"] * guess


def test_cameras_of_several_reconstructions(tmp_path: Path) -> None:
    cameras = read(tmp_path, [{"cameras": {"a": GUESS, "b": GUESS}}, {"cameras": {"a": {**GUESS, "focal": 0.9}}}])
    assert list(cameras) == ["a", "b", "a (2)"]
    assert exact(cameras["a (2)"]).params[0] == 900


def test_without_image_size_it_is_asked_for(tmp_path: Path) -> None:
    imported = read(tmp_path, {"a": {"projection_type": "perspective", "focal": 0.9}})["a"]
    with pytest.raises(InputError, match="--image-size"):
        exact(imported)
    np.testing.assert_allclose(exact(imported.resize((W, H))).params[:4], [900, 900, 499.5, 399.5])


@pytest.mark.parametrize("kind", ["dual", "spherical", "equirectangular", "unheard_of"])
def test_other_types_are_refused_by_name(tmp_path: Path, kind: str) -> None:
    with pytest.raises(NotExactError, match=kind):
        exact(camera_of(tmp_path, kind, focal=0.9))


def test_gaussian_splattings_cameras_json_is_not_one(tmp_path: Path) -> None:
    path = tmp_path / "cameras.json"
    path.write_text(json.dumps([{"id": 0, "img_name": "a", "position": [0, 0, 0], "fx": 900, "fy": 900}]))
    assert not OpenSfM().recognises(path)


@pytest.mark.parametrize("fields", [{"focal": -0.9}, {"focal": "nan"}, {"k1": 0.1}, {"focal": 0.9, "width": -5}])
def test_refused(tmp_path: Path, fields: dict) -> None:
    with pytest.raises(FileFormatError):
        camera_of(tmp_path, "perspective", **fields)


def test_null_counts_as_not_there(tmp_path: Path) -> None:
    assert exact(camera_of(tmp_path, "perspective", focal=0.9, k1=None)).params[4] == 0


def test_what_it_cannot_carry_is_refused(tmp_path: Path) -> None:
    camera = Camera("x", "opencv8", np.array([900.0, 900, 500, 400, 0, 0, 0, 0, 0, 0.1, 0, 0]), (W, H))
    with pytest.raises(InputError, match="k4"):
        OpenSfM().write({"x": camera}, tmp_path / "cameras.json")
