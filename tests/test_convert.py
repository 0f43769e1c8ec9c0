"""The commands that take any program's camera file: convert, show, compare, formats."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from opencsp_calib import Camera
from opencsp_calib.cli import run
from opencsp_calib.hdf5 import load_record, save_camera

K, RADIAL = [[900.0, 0, 500], [0, 901.0, 400], [0, 0, 1]], [-0.2, 0.05, 0.01, -0.03]
EYE = """
{side}:
  model: pinhole_radial_tangential
  pinhole:
    {{fx: 900.0, fy: 901.0, cx: 500.5, cy: 400.5, width: 1000, height: 800, skew: 0.0}}
  radial_tangential: {{radial: {radial}, t1: 0.0, t2: 0.0}}
"""
STEREO = EYE.format(side="left", radial=RADIAL) + EYE.format(side="right", radial=RADIAL[:2])
CHAIN = """
cam0: {camera_model: pinhole, distortion_model: none, intrinsics: [900, 901, 500, 400], resolution: [1000, 800]}
cam1: {camera_model: pinhole, distortion_model: none, intrinsics: [903, 901, 500, 400], resolution: [1000, 800]}
"""
TEXTS = ("yml", "xml", "json", "ros.yaml", "ini", "kalibr.yaml", "txt", "cameramodel", "metashape.xml", "opensfm.json")
NAMED = {"ros.yaml": "ros", "kalibr.yaml": "kalibr", "metashape.xml": "metashape", "opensfm.json": "opensfm"}
NAMED |= {"yml": "opencv", "xml": "opencv", "json": "opencv", "transforms.json": "transforms_json", "txt": "colmap"}


@pytest.fixture
def stereo(tmp_path: Path) -> Path:
    path = tmp_path / "stereo.yaml"
    path.write_text(STEREO)
    return path


def command(*arguments: object, code: int = 0) -> None:
    assert run([str(argument) for argument in arguments]) == code


def test_a_fit_is_printed_and_stored(stereo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "camera.h5"
    command("convert", stereo, out, "--camera", "left", "--fit", "opencv5", "--accept-error", 5, "--json")
    said = capsys.readouterr()
    fit = json.loads(said.out)["fit"]
    assert 0.01 < fit["worst_px"] < 5
    assert fit["coverage"] == 1.0
    line = f"opencv5, rms {fit['rms_px']:.3g} px, worst {fit['worst_px']:.3g} px over 100 % of the image"
    assert f"fitted {line}" in said.err
    record = load_record(out)
    assert record["import fit"] == line
    assert "0.5 px" in record["import unverified-convention"]
    command("show", out)
    assert line in capsys.readouterr().err


def test_a_fit_of_more_than_a_tenth_of_a_pixel_is_asked_about(stereo: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "camera.h5"
    command("convert", stereo, out, "--camera", "left", "--fit", "opencv4", code=2)
    said = " ".join(capsys.readouterr().err.split())
    found = re.search(r"rms .* px, worst .* px .* --accept-error (\S+)", said)
    assert found is not None
    assert not out.exists()
    command("convert", stereo, out, "--camera", "left", "--fit", "opencv4", "--accept-error", found[1])


@pytest.mark.parametrize("kind", TEXTS)
def test_text_files_keep_the_notes_and_are_read_as_before(kind: str, stereo: Path, tmp_path: Path, capsys) -> None:
    out, plain = tmp_path / f"camera.{kind}", tmp_path / f"plain.{kind}"
    to = ["--to", NAMED[kind]] if kind in NAMED else []
    model = "pinhole" if kind == "kalibr.yaml" else "opencv4"
    fit = ["--camera", "left", "--fit", model, "--accept-error", 1000]
    command("convert", stereo, tmp_path / "camera.h5", *fit)
    command("convert", stereo, out, *fit, *to)
    text = out.read_text()
    assert f"{model}, rms " in text
    assert "0.5 px too small" in text
    capsys.readouterr()
    command("compare", out, tmp_path / "camera.h5", "--json")
    assert json.loads(capsys.readouterr().out)["worst_px"] < 1e-9
    command("convert", tmp_path / "camera.h5", plain, *to)  # what was recorded goes on with the camera
    assert "0.5 px too small" in plain.read_text()


@pytest.mark.parametrize("kind", ["yml", "xml", "json"])
def test_opencv_reads_files_with_notes(kind: str, stereo: Path, tmp_path: Path) -> None:
    out = tmp_path / f"camera.{kind}"
    command("convert", stereo, out, "--camera", "left", "--fit", "opencv8", "--to", "opencv")
    storage = cv2.FileStorage(str(out), cv2.FILE_STORAGE_READ)
    assert storage.getNode("distortion_coefficients").mat().size == 8


def test_a_file_without_room_says_so(stereo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    command("convert", stereo, tmp_path / "cameras.bin", "--camera", "right")
    assert "notes-not-stored" in capsys.readouterr().err


def test_cameras_are_listed_and_chosen(stereo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chain, right = tmp_path / "camchain.yaml", tmp_path / "right.h5"
    chain.write_text(CHAIN)
    for words in (("show", chain), ("compare", chain, chain), ("convert", chain, tmp_path / "x.h5")):
        command(*words, code=2)
        assert "choose one with --camera: cam0, cam1" in capsys.readouterr().err
    command("show", chain, "--camera", "cam1", "--json")
    assert json.loads(capsys.readouterr().out)["params"]["fx"] == 903.0
    command("compare", chain, chain, "--camera", "cam0", "--json")
    assert json.loads(capsys.readouterr().out)["worst_px"] < 1e-9
    command("compare", chain, chain, "--camera", "cam0", "--camera", "cam1", "--json")
    assert json.loads(capsys.readouterr().out)["worst_px"] > 0.5
    command("convert", stereo, right, "--camera", "right")
    command("compare", stereo, right, "--camera", "right", "--json")
    assert json.loads(capsys.readouterr().out)["worst_px"] < 1e-9


def test_a_size_that_no_file_has_is_given_to_all_that_take_one(tmp_path: Path, capsys) -> None:
    path = tmp_path / "intrinsics.json"
    path.write_text(json.dumps({"mtx": K, "dist": [*RADIAL, 0.0]}))
    command("compare", path, path, code=2)
    assert "add --image-size" in capsys.readouterr().err
    command("compare", path, path, "--image-size", "1000x800")
    command("show", path, "--image-size", "1000x800")
    photograph = tmp_path / "photograph.png"
    cv2.imwrite(str(photograph), np.zeros((800, 1000), np.uint8))
    command("undistort", path, photograph, "-o", tmp_path / "out", "--image-size", "1000x800")


def test_a_guess_that_has_to_be_chosen_says_how(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    chain = tmp_path / "camchain.yaml"
    chain.write_text(CHAIN)
    photograph = tmp_path / "photograph.png"
    cv2.imwrite(str(photograph), np.zeros((800, 1000), np.uint8))
    command("calibrate", photograph, "--board", "checkerboard:5x6:50mm", "--guess", chain, code=2)
    said = capsys.readouterr().err
    assert "cam0, cam1; `opencsp-calib convert` takes these options" in " ".join(said.split())


def test_formats_say_what_is_exact_and_what_is_fitted(capsys: pytest.CaptureFixture[str]) -> None:
    command("formats", "--json")
    said = capsys.readouterr()
    by_name = {one["name"]: one for one in json.loads(said.out)["formats"]}
    assert by_name["kalibr"]["fitted"] == ["omni", "eucm", "ds", "fov"]
    assert by_name["kalibr"]["models"] == ["pinhole", "opencv4", "opencv_fisheye"]
    header = next(line for line in said.err.splitlines() if "read" in line)
    assert header.rstrip().endswith("only with --fit")


def test_a_camera_file_converted_keeps_its_name_numbers_and_record(tmp_path: Path) -> None:
    camera = Camera("cam", "opencv4", np.array([900.0, 901, 500, 400, *RADIAL]), (1000, 800))
    save_camera(camera, tmp_path / "a.h5", {"aperture": "f/8"})
    command("convert", tmp_path / "a.h5", tmp_path / "b.h5", "--name", "other")
    again = Camera.load(tmp_path / "b.h5")
    assert again.name == "other"
    assert (again.params == camera.params).all()
    assert load_record(tmp_path / "b.h5") == {"aperture": "f/8"}


LONG = "x" * 300
SAID = [
    (["show", LONG], "cannot be read: File name too long|does not exist"),
    (["convert", "{file}", LONG + ".h5"], "cannot write x+\\.\\.\\."),
    (["calibrate", LONG, "--board", "checkerboard:5x6:50mm"], "too long for a file"),
]


@pytest.mark.parametrize(("words", "said"), SAID)
def test_names_that_no_file_can_have(words: list[str], said: str, stereo: Path, capsys) -> None:
    command(*(word.format(file=stereo) for word in words), *(["--camera", "right"] * ("convert" in words)), code=2)
    assert re.search(said, " ".join(capsys.readouterr().err.split()))


@pytest.mark.skipif(sys.platform == "win32", reason="POSIX devices, pipes and links")
def test_devices_pipes_and_circles_of_links_are_no_outputs(stereo: Path, tmp_path: Path, capsys) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "circle").symlink_to("circle")
    for out in ("/dev/null", tmp_path / "pipe", tmp_path / "circle"):
        command("convert", stereo, out, "--camera", "right", "--to", "ros", code=2)
        assert "cannot write" in capsys.readouterr().err
    command("show", tmp_path / "circle", code=2)
    assert not Path("/dev/null").is_file()


@pytest.mark.skipif(sys.platform == "win32", reason="links need a privilege")
def test_a_link_stays_and_what_it_leads_to_is_written(stereo: Path, tmp_path: Path) -> None:
    (tmp_path / "link.h5").symlink_to("real.h5")
    command("convert", stereo, tmp_path / "link.h5", "--camera", "right")
    assert (tmp_path / "link.h5").is_symlink()
    assert Camera.load(tmp_path / "real.h5").name == "right"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is always full")
@pytest.mark.parametrize("closed", [">/dev/full", ">&-", "2>/dev/full", "2>&-", "<&-", "env"])
def test_outputs_that_are_closed_or_full_and_an_empty_environment(closed: str, tmp_path: Path) -> None:
    save = Camera("cam", "pinhole", np.array([900.0, 901, 500, 400]), (1000, 800)).save
    save(tmp_path / "c.h5")
    bare = ["env", "-i"] if closed == "env" else []
    where = "" if closed == "env" else closed
    show = [sys.executable, "-m", "opencsp_calib", "show", str(tmp_path / "c.h5"), "--json"]
    line = f"{shlex.join([*bare, *show])} {where}"
    usual = {name: value for name, value in os.environ.items() if name != "PYTHONUNBUFFERED"}
    done = subprocess.run(["sh", "-c", line], capture_output=True, text=True, check=False, env=usual)
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    assert done.returncode == (2 if closed.startswith(">") else 0)


def test_of_two_files_it_says_which(stereo: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = tmp_path / "good.h5"
    command("convert", stereo, good, "--camera", "left", "--fit", "opencv5", "--accept-error", 5)
    command("compare", good, stereo, code=2)
    assert f"error: {stereo}: the file has 2 cameras" in capsys.readouterr().err
