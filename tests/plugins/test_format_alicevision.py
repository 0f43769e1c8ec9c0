"""AliceVision: its own compatibility scenes, the rules of its versions, and its distortions by formula."""

import json
from pathlib import Path

import numpy as np
import pytest
from format_truth import agree, directions, opencv, opencv_fisheye, perspective
from opencsp_calib_formats.alicevision import AliceVision

from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

W, H = 1000, 800
K = (900.0, 1800.0, 503.5, 397.75)


def read(tmp_path: Path, intrinsic: dict, version=(1, 2, 11)):
    content = {"version": [str(n) for n in version], "intrinsics": [intrinsic]}
    path = tmp_path / "cameras.sfm"
    path.write_text(json.dumps(content))
    assert AliceVision().recognises(path)
    return next(iter(AliceVision().read(path).values()))


def intrinsic(kind: str = "pinhole", distortion: str = "none", params=(), **fields: object) -> dict:
    base = {"intrinsicId": "7", "width": str(W), "height": str(H), "sensorWidth": "36", "type": kind}
    base |= {"focalLength": repr(1800 * 36 / W), "pixelRatio": "2", "principalPoint": ["3.5", "-2.25"]}
    base |= {"distortionType": distortion, "distortionParams": [repr(p) for p in params] or ""}
    return base | {"initializationMode": "estimated"} | fields


@pytest.mark.parametrize("version", ["0", "6", "11"])
def test_official_scenes(data_dir: Path, version: str) -> None:
    cameras = AliceVision().read(data_dir / "formats" / "alicevision" / f"scene_v1.2.{version}.cut.json")
    bare, radial = (exact(imported) for imported in cameras.values())
    np.testing.assert_allclose(bare.params, [1000, 2000, 2020, 1040], rtol=1e-12)
    np.testing.assert_allclose(radial.params, [1000, 2000, 2020, 1040, 0.1, 0.05, 0, 0, -0.001], rtol=1e-12)
    assert bare.image_size == radial.image_size == (4092, 2048)


@pytest.mark.parametrize(
    ("version", "fields"),
    [
        ((1, 1, 0), {"pxFocalLength": "900", "principalPoint": ["503.5", "397.75"]}),
        ((1, 2, 0), {"pxFocalLength": ["900", "1800"], "principalPoint": ["503.5", "397.75"]}),
        ((1, 2, 1), {"pxFocalLength": ["900", "1800"]}),
        ((1, 2, 2), {"focalLength": "32.4", "pixelRatio": "0.5"}),
        ((1, 2, 4), {"focalLength": "32.4", "pixelRatio": "0.5"}),
        ((1, 2, 5), {"focalLength": "32.4", "pixelRatio": "2"}),
        ((1, 2, 10), {"focalLength": "32.4", "pixelRatio": "2"}),
        ((1, 2, 11), {"focalLength": "64.8", "pixelRatio": "2"}),
        ((1, 3, 0), {"focalLength": "64.8", "pixelRatio": "2"}),
    ],
)
def test_the_same_camera_in_all_versions(tmp_path: Path, version: tuple, fields: dict) -> None:
    expected = (900, 900, *K[2:]) if version < (1, 2, 0) else K
    imported = read(tmp_path, intrinsic(**fields), version)
    np.testing.assert_allclose(exact(imported).params, expected, rtol=1e-12)


@pytest.mark.parametrize(
    ("distortion", "params", "coefficients"),
    [
        ("radialk1", (-0.1,), (-0.1, 0, 0, 0)),
        ("radialk3", (-0.1, 0.02, -0.003), (-0.1, 0.02, 0, 0, -0.003)),
        ("brown", (-0.1, 0.02, -0.003, 1e-3, -2e-3), (-0.1, 0.02, 1e-3, -2e-3, -0.003)),
    ],
)
def test_distortions_that_are_opencvs(tmp_path: Path, distortion: str, params: tuple, coefficients: tuple) -> None:
    camera = exact(read(tmp_path, intrinsic("pinhole", distortion, params)))
    agree(camera.project(directions()), opencv(directions(), K, coefficients))


def test_radialk3pt_is_one_at_unit_radius(tmp_path: Path) -> None:
    k1, k2, k3 = k = (-0.1, 0.02, -0.003)
    camera = exact(read(tmp_path, intrinsic("pinhole", "radialk3pt", k)))
    x, y = perspective(directions())
    r = np.hypot(x, y)
    scale = (1 + k1 * r**2 + k2 * r**4 + k3 * r**6) / (1 + k1 + k2 + k3)
    agree(camera.project(directions()), np.column_stack([K[0] * x * scale + K[2], K[1] * y * scale + K[3]]))


@pytest.mark.parametrize(("kind", "distortion"), [("fisheye4", ""), ("pinhole", "fisheye")])
def test_fisheye(tmp_path: Path, kind: str, distortion: str) -> None:
    k = (0.01, -0.02, 1e-3, -2e-4)
    fields = intrinsic(kind, distortion, k)
    if not distortion:
        del fields["distortionType"]
    camera = exact(read(tmp_path, fields))
    agree(camera.project(directions(80)), opencv_fisheye(directions(80), K, k))


def test_fisheye1_is_the_field_of_view_model(tmp_path: Path) -> None:
    imported = read(tmp_path, intrinsic("pinhole", "fisheye1", (0.93,)))
    with pytest.raises(NotExactError, match=r"fisheye1 = 0\.93"):
        exact(imported)
    x, y = perspective(directions(60))
    r = np.where(np.hypot(x, y) > 0, np.hypot(x, y), 1)
    scale = np.arctan(2 * r * np.tan(0.93 / 2)) / 0.93 / r
    expected = np.column_stack([K[0] * x * scale + K[2], K[1] * y * scale + K[3]])
    agree(imported.project(directions(60)), expected)


@pytest.mark.parametrize(
    "fields",
    [
        intrinsic("equidistant", "none"),
        intrinsic("pinhole", "3deanamorphic4"),
        intrinsic(undistortionType="3declassicld"),
        intrinsic(undistortionParams=["0.1"]),
        intrinsic(focalLength="-1"),
    ],
)
def test_other_lenses_are_refused(tmp_path: Path, fields: dict) -> None:
    with pytest.raises(NotExactError):
        exact(read(tmp_path, fields))


@pytest.mark.parametrize(
    ("fields", "codes"),
    [
        ({}, ["unverified-convention"]),
        ({"initializationMode": "calibrated"}, ["unverified-convention"]),
        ({"initializationMode": "unknown"}, ["unverified-convention", "not-a-result"]),
        ({"locked": "1"}, ["unverified-convention", "not-a-result"]),
        ({"locked": "true"}, ["unverified-convention", "not-a-result"]),
        ({"locked": "false"}, ["unverified-convention"]),
        ({"width": "800", "height": "1000"}, ["unverified-convention", "unverified-convention"]),
    ],
)
def test_notes(tmp_path: Path, fields: dict, codes: list) -> None:
    notes = read(tmp_path, intrinsic(**fields)).notes
    assert [note.code for note in notes] == codes
    assert "0.5 px" in notes[0].message


def test_a_scene_before_calibration_is_no_result(data_dir: Path) -> None:
    (imported,) = AliceVision().read(data_dir / "formats" / "alicevision" / "small.sfm").values()
    assert "not-a-result" in [note.code for note in imported.notes]


@pytest.mark.parametrize(
    "fields",
    [
        intrinsic("pinhole", "brown", (0.1, 0.2)),
        intrinsic("pinhole", "radialk3pt", (-1.0, 0.0, 0.0)),
        intrinsic(pixelRatio="0"),
        intrinsic(sensorWidth="0"),
        intrinsic(width="0"),
        intrinsic(principalPoint=["1"]),
        intrinsic("pinhole", "fisheye1", (4.0,)),
    ],
)
def test_refused(tmp_path: Path, fields: dict) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, fields)


def test_a_version_newer_than_we_know_is_read_with_a_warning(tmp_path: Path) -> None:
    path = tmp_path / "cameras.sfm"
    intrinsic = {"intrinsicId": "1", "width": "400", "height": "300", "type": "pinhole", "focalLength": "4"}
    intrinsic |= {"sensorWidth": "8", "principalPoint": ["0", "0"], "distortionType": "none"}
    for version, warned in ((["1", "2", "11"], False), (["1", "2", "12"], True), (["1", "3", "0"], True)):
        path.write_text(json.dumps({"version": version, "intrinsics": [intrinsic]}))
        notes = AliceVision().read(path)["1"].notes
        assert any("newer version" in note.message for note in notes) is warned
