"""Pix4D: the same project in millimetres and in pixels."""

from pathlib import Path

import numpy as np
import pytest
from format_files_photogrammetry import PIX4D_CAM, PIX4D_TXT
from format_truth import agree, directions, opencv
from opencsp_calib_formats.pix4d import Pix4D

from opencsp_calib import InputError
from opencsp_calib.errors import FileFormatError, NotExactError
from opencsp_calib.importing import exact

FILE = "pix4d_calibrated_internal_camera_parameters.cam"
HEADER = PIX4D_TXT.decode().split("X\n")[0] + "X\n\n"

PUBLISHED = """DJI_0954.JPG 4608 3456
3952.81247514184087776812 0 2233.46124792750424603582
0 3952.81247514184087776812 1667.92521335858214115433
0 0 1
0.03833474118270804865 -0.01750917966495743258 0.02049798716391852335
0.00240851666319534747 0.00292562392135245920
21.54872206687879199194 -29.58734160676452162875 30.85702810138878149360
0.78389904231994589345 -0.62058396220897726892 -0.01943803742353054573
-0.62086105345046738169 -0.78318706257080084043 -0.03390541741516269608
0.00581753884797473961 0.03864674463298682638 -0.99923600083815289352
"""
"""Of the same project as the .cam file: EasyIDP's documentation."""


def read(tmp_path: Path, text: str, name: str = "parameters.txt"):
    path = tmp_path / name
    path.write_text(text)
    assert Pix4D().recognises(path)
    return Pix4D().read(path)


def test_both_files_of_one_project_agree(data_dir: Path, tmp_path: Path) -> None:
    millimetres = Pix4D().read(data_dir / "formats" / "pix4d" / FILE)["0"]
    with pytest.raises(InputError, match="--image-size"):
        exact(millimetres)
    from_cam = exact(millimetres.resize((4608, 3456)))
    from_txt = exact(read(tmp_path, HEADER + PUBLISHED)["DJI_0954.JPG"])
    np.testing.assert_allclose(from_cam.params, from_txt.params, rtol=1e-9)
    assert from_txt.image_size == from_cam.image_size == (4608, 3456)


def test_the_formula_is_opencvs_from_the_images_corner(tmp_path: Path) -> None:
    camera = exact(read(tmp_path, HEADER + PUBLISHED)["DJI_0954.JPG"])
    k = (3952.81247514184, 3952.81247514184, 2233.461247927504 - 0.5, 1667.925213358582 - 0.5)
    d = (0.038334741182708, -0.017509179664957, 0.002408516663195, 0.002925623921352, 0.020497987163918)
    agree(camera.project(directions()), opencv(directions(), k, d))


def test_the_half_pixel_is_flagged(tmp_path: Path) -> None:
    for imported in (
        read(tmp_path, HEADER + PUBLISHED)["DJI_0954.JPG"],
        read(tmp_path, PIX4D_CAM.decode(), "a.cam")["0"],
    ):
        assert [note.code for note in imported.notes] == ["unverified-convention"]
        assert "0.5 px" in imported.notes[0].message


def test_several_cameras(tmp_path: Path) -> None:
    text = PIX4D_CAM.decode()
    cameras = read(tmp_path, text + text.replace("file 0", "file 1").replace("F 9.0", "F 8.0"), "a.cam")
    assert [exact(cameras[name].resize((1000, 800))).params[0] for name in ("0", "1")] == [900, 800]
    other = PUBLISHED.replace("DJI_0954", "b c").replace("3952.81247514184087776812", "4000")
    assert list(read(tmp_path, HEADER + PUBLISHED + PUBLISHED.replace("0954", "0955") + other)) == [
        "DJI_0954.JPG",
        "b c.JPG",
    ]


def test_images_of_another_shape_are_not_of_this_sensor(tmp_path: Path) -> None:
    imported = read(tmp_path, PIX4D_CAM.decode(), "a.cam")["0"]
    with pytest.raises(InputError, match="shape"):
        imported.resize((1000, 1000))


def test_skew_and_fisheye_are_refused(tmp_path: Path) -> None:
    skewed = PUBLISHED.replace("3952.81247514184087776812 0 ", "3952.81247514184087776812 1.5 ")
    with pytest.raises(NotExactError, match="skew"):
        exact(read(tmp_path, HEADER + skewed)["DJI_0954.JPG"])
    with pytest.raises(NotExactError, match="fisheye"):
        exact(read(tmp_path, "Pix4D camera calibration file 0\nC 1\nD 0\nE 0\nF 1\nP0 0\n", "a.cam")["0"])
    with pytest.raises(FileFormatError, match="fisheye"):
        read(tmp_path, HEADER.replace("radial distortion [3x1]", "polynomial") + PUBLISHED)


@pytest.mark.parametrize("lines", [1, 5, 9])
def test_truncated_photographs_are_refused(tmp_path: Path, lines: int) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, HEADER + "\n".join(PUBLISHED.split("\n")[:lines]))


@pytest.mark.parametrize("change", [("F 9.0", "F -9.0"), ("10.00x8.00mm", ""), ("10.00x", "-10.00x"), ("Px 5.1\n", "")])
def test_refused(tmp_path: Path, change: tuple) -> None:
    with pytest.raises(FileFormatError):
        read(tmp_path, PIX4D_CAM.decode().replace(*change), "a.cam")
