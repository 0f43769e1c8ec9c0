"""Metashape: its own OpenCV export and the manual's formula against the reader."""

from pathlib import Path

import cv2
import numpy as np
import pytest
from format_truth import agree, directions, opencv, perspective
from opencsp_calib_formats.metashape import Metashape

from opencsp_calib import Camera, InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact, fitted

W, H = 1000, 800


def lens(kind: str = "frame", **terms: float) -> str:
    values = "".join(f"<{key}>{value!r}</{key}>" for key, value in terms.items())
    return f"<calibration><projection>{kind}</projection><width>{W}</width><height>{H}</height>{values}</calibration>"


def read(tmp_path: Path, text: str):
    path = tmp_path / "lens.xml"
    path.write_text(text)
    return Metashape().read(path)


def manual(x, y, f=900.5, cx=0.0, cy=0.0, b1=0.0, b2=0.0, k=(), p=(), growth=()):
    """The formula of the manual's appendix, with the origin of pixels moved to the centre of the first one."""
    r = np.hypot(x, y)
    radial = 1 + sum(c * r ** (2 * i + 2) for i, c in enumerate(k))
    p1, p2 = p or (0, 0)
    further = 1 + sum(c * r ** (2 * i + 2) for i, c in enumerate(growth))
    xd = x * radial + (p1 * (r**2 + 2 * x**2) + 2 * p2 * x * y) * further
    yd = y * radial + (p2 * (r**2 + 2 * y**2) + 2 * p1 * x * y) * further
    return np.column_stack([W * 0.5 + cx + xd * f + xd * b1 + yd * b2, H * 0.5 + cy + yd * f]) - 0.5


def test_equals_the_opencv_file_that_metashape_wrote_itself(data_dir: Path) -> None:
    folder = data_dir / "formats" / "metashape"
    storage = cv2.FileStorage(str(folder / "24mm_opencv.xml"), cv2.FILE_STORAGE_READ)
    k, d = storage.getNode("Camera_Matrix").mat(), storage.getNode("Distortion_Coefficients").mat().ravel()
    camera = exact(Metashape().read(folder / "24mm_metashape.xml")["camera"])
    assert camera.image_size == (6012, 4008)
    agree(camera.project(directions(30)), opencv(directions(30), k[[0, 1, 0, 1], [0, 1, 2, 2]], d), 1e-6)


def test_real_chunk(data_dir: Path) -> None:
    cameras = Metashape().read(data_dir / "formats" / "metashape" / "cameras_2.0.0.cut.xml")
    camera = exact(cameras["unknown"])
    expected = [2856.95249, 2856.95249, 2114.64377, 1130.42867, 0.053295307, -0.0646551689, 0, 0]
    np.testing.assert_allclose(camera.params, expected, rtol=1e-8)
    assert camera.image_size == (4224, 2240)
    assert cameras["unknown"].notes == ()


def test_metashapes_own_opencv_export_is_not_taken_for_a_lens(data_dir: Path) -> None:
    assert not Metashape().recognises(data_dir / "formats" / "metashape" / "24mm_opencv.xml")


def test_frame_equals_the_manual(tmp_path: Path) -> None:
    terms = {
        "f": 900.5,
        "cx": 3.25,
        "cy": -2.5,
        "b1": 1.5,
        "k1": -0.1,
        "k2": 0.02,
        "k3": -0.003,
        "p1": 4e-4,
        "p2": -2e-4,
    }
    camera = exact(read(tmp_path, lens(**terms))["camera"])
    x, y = perspective(directions())
    agree(camera.project(directions()), manual(x, y, 900.5, 3.25, -2.5, 1.5, 0, (-0.1, 0.02, -0.003), (4e-4, -2e-4)))


@pytest.mark.parametrize(
    ("terms", "named"),
    [
        ({"b2": -1.16}, "b2 = -1.16"),
        ({"k4": 0.02}, "k4 = 0.02"),
        ({"p1": 1e-3, "p2": 1e-3, "p3": 0.3, "p4": -0.1}, "p3 = 0.3"),
    ],
)
def test_what_is_in_the_way_is_named_and_the_manual_can_be_fitted(tmp_path: Path, terms: dict, named: str) -> None:
    imported = read(tmp_path, lens(f=900.5, k1=-0.1, **terms))["camera"]
    assert imported.camera is None
    with pytest.raises(NotExactError, match=named):
        exact(imported)
    x, y = perspective(directions())
    k = (-0.1, 0, 0, terms.get("k4", 0))
    p, growth = (terms.get("p1", 0), terms.get("p2", 0)), (terms.get("p3", 0), terms.get("p4", 0))
    agree(imported.project(directions()), manual(x, y, b2=terms.get("b2", 0), k=k, p=p, growth=growth))


def test_skew_is_not_absorbed_by_a_fit_but_a_term_in_r8_is(tmp_path: Path) -> None:
    with pytest.raises(NotExactError, match="--accept-error"):
        fitted(read(tmp_path, lens(f=900.5, k1=-0.1, b2=-1.16))["camera"], "opencv5")
    assert fitted(read(tmp_path, lens(f=900.5, k1=-0.1, k4=0.02))["camera"], "opencv8").worst_px < 0.02


def test_growth_of_no_tangential_term_is_nothing(tmp_path: Path) -> None:
    assert read(tmp_path, lens(f=900.5, k1=-0.1, p3=0.3))["camera"].camera is not None


@pytest.mark.parametrize("kind", ["fisheye", "equidistant_fisheye", "equisolid_fisheye"])
@pytest.mark.parametrize("p1", [0.0, 1e-3])
def test_fisheyes_equal_the_manual(tmp_path: Path, kind: str, p1: float) -> None:
    terms = {"f": 400.0, "b1": 1.0, "k1": 0.01, "k2": -0.02, "k3": 0.001, "k4": -2e-4}
    imported = read(tmp_path, lens(kind, **terms, **({"p1": p1} if p1 else {})))["camera"]
    points = directions(80)
    x0, y0 = perspective(points)
    r0 = np.hypot(x0, y0)
    length = 2 * np.sin(np.arctan(r0) / 2) if kind == "equisolid_fisheye" else np.arctan(r0)
    norm = np.where(r0 > 0, length / np.where(r0 > 0, r0, 1), 1)
    k = (0.01, -0.02, 0.001, -2e-4)
    expected = manual(x0 * norm, y0 * norm, 400.0, b1=1.0, k=k, p=(p1, 0))
    agree(imported.project(points), expected)
    assert (imported.camera is not None) == (p1 == 0 and kind != "equisolid_fisheye")


def test_old_photoscan_has_pixels_and_unswapped_terms_and_is_flagged(tmp_path: Path) -> None:
    terms = {"fx": 901.5, "fy": 900.5, "cx": 503.0, "cy": 399.0, "k1": -0.1, "p1": 4e-4, "p2": -2e-4}
    imported = read(tmp_path, lens(**terms))["camera"]
    agree(imported.project(directions()), opencv(directions(), (901.5, 900.5, 502.5, 398.5), (-0.1, 0, 4e-4, -2e-4)))
    assert [note.code for note in imported.notes] == ["unverified-convention"]
    assert read(tmp_path, lens(**terms, skew=1.5))["camera"].obstacles


def chunk(*sensors: str) -> str:
    return f'<document version="1.5.0"><chunk><sensors>{"".join(sensors)}</sensors></chunk></document>'


def sensor(label: str, *calibrations: str, more: str = "", kind: str = "frame") -> str:
    size = f'<resolution width="{W}" height="{H}"/>'
    inside = "".join(f"<calibration {c}</calibration>" for c in calibrations)
    return f'<sensor id="{label}" label="{label}" type="{kind}" {more}>{size}{inside}</sensor>'


def test_chunk_prefers_the_adjusted_calibration_and_leaves_out_sensors_without(tmp_path: Path) -> None:
    text = chunk(
        sensor("a", 'class="initial"><f>1</f>', 'class="adjusted"><f>900.5</f>'),
        sensor("b", 'class="initial"><f>800</f>'),
        sensor("c"),
        sensor("d", more='master_id="a"'),
        sensor("e", 'class="adjusted"><f>1</f>', kind="spherical"),
    )
    cameras = read(tmp_path, text)
    assert list(cameras) == ["a", "b", "d", "e"]
    assert cameras["a"].camera.params[0] == cameras["d"].camera.params[0] == 900.5
    assert cameras["a"].notes == ()
    assert [note.code for note in cameras["b"].notes] == ["not-a-result"]
    with pytest.raises(NotExactError, match="spherical"):
        exact(cameras["e"])


def test_chunk_without_any_calibration_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileFormatError, match="calibration"):
        read(tmp_path, chunk(sensor("a")))


@pytest.mark.parametrize(
    "text",
    [
        lens(k1=0.1),
        lens(f=-900.5),
        lens(f=0.0),
        lens(f=900.5).replace("<width>1000</width>", ""),
        lens(f=900.5).replace("</calibration>", "<k1>0.1</k1><k1>0.2</k1></calibration>"),
        '<!DOCTYPE a [<!ENTITY b "900">]>' + lens(f=900.5).replace("900.5", "&b;"),
        '<rig><camera><camera_model type="calibu_fu_fv_u0_v0_k1_k2"></camera_model></camera></rig>',
        '<Cameras SOURCE="Nexus"><Camera></Camera></Cameras>',
    ],
)
def test_refused(tmp_path: Path, text: str) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, text)


def test_what_it_cannot_carry_is_refused_and_nothing_is_written(tmp_path: Path) -> None:
    camera = Camera("x", "opencv8", np.array([900.0, 900, 500, 400, 0, 0, 0, 0, 0, 0.1, 0, 0]), (W, H))
    with pytest.raises(InputError, match="k4"):
        Metashape().write({"x": camera}, tmp_path / "lens.xml")
    plain = Camera("x", "pinhole", np.array([900.0, 900, 500, 400]), (W, H))
    with pytest.raises(InputError, match="one camera"):
        Metashape().write({"x": plain, "y": plain}, tmp_path / "lens.xml")
    assert list(tmp_path.iterdir()) == []


def test_the_ids_of_sensors_are_those_of_their_chunk(tmp_path: Path) -> None:
    def chunk(f: int) -> str:
        adjusted = f'<calibration type="frame" class="adjusted"><f>{f}</f></calibration>'
        size = f'<resolution width="{W}" height="{H}"/>'
        master = f'<sensor id="0" label="master {f}" type="frame">{size}{adjusted}</sensor>'
        return f'<chunk>{master}<sensor id="1" label="slave {f}" type="frame" master_id="0">{size}</sensor></chunk>'

    path = tmp_path / "cameras.xml"
    path.write_text(f"<document>{chunk(900)}{chunk(700)}</document>")
    cameras = Metashape().read(path)
    assert {name: exact(imported).params[0] for name, imported in cameras.items()} == {
        "master 900": 900,
        "slave 900": 900,
        "master 700": 700,
        "slave 700": 700,
    }
