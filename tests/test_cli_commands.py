"""The commands beside the main job, as people use them."""

import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from command_line import answer, complaint
from worlds import SmallWorld

from opencsp_calib import Camera
from opencsp_calib.cli import run
from opencsp_calib.images import find_images, read_image
from opencsp_calib.models import LENS_MODELS


def test_compare_says_how_far_apart(small_world: SmallWorld, camera_file: Path, tmp_path: Path, capsys) -> None:
    small_world.camera.save(tmp_path / "truth.h5")
    plot = tmp_path / "difference.png"
    printed = answer(capsys, "compare", camera_file, tmp_path / "truth.h5", "--plot", plot)
    assert printed["worst_px"] < 0.2
    assert printed["range_m"] is None
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert answer(capsys, "compare", camera_file, camera_file, "--range", 2)["worst_px"] < 1e-9


def test_undistort_writes_images(camera_file: Path, photographs: Path, tmp_path: Path, capsys) -> None:
    assert run(["undistort", str(camera_file), str(photographs), "-o", str(tmp_path / "flat")]) == 0
    camera, files = Camera.load(camera_file), find_images(photographs)
    flat = {file.name: read_image(file).pixels for file in find_images(tmp_path / "flat")}
    assert list(flat) == [file.name for file in files]
    for file in files:
        assert np.array_equal(flat[file.name], camera.undistort(read_image(file).pixels))
    assert "another folder" in complaint(capsys, "undistort", camera_file, photographs, "-o", photographs)


def test_validate_lets_solvers_answer_without_images(camera_file: Path, tmp_path: Path, capsys) -> None:
    report = tmp_path / "v.html"
    printed = answer(capsys, "validate", camera_file, "--solvers", "bundle,opencv", "--report", report)
    assert set(printed["solvers"]) == {"bundle", "opencv"}
    assert printed["differences"][0]["worst_px"] < 1e-4
    assert printed["halves"]["worst_px"] > 0
    assert printed["verdict"] == "agree"
    page = report.read_text(encoding="utf-8")
    assert "The solvers agree." in page
    assert page.lower().count("solvers agree") == 1


def test_check_tells_a_good_camera_from_a_bad_one(
    small_world: SmallWorld, photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small_world.camera.save(tmp_path / "good.h5")
    printed = answer(capsys, "check", tmp_path / "good.h5", photographs, "--board", SmallWorld.spec)
    assert printed["verdict"] == "ok"
    params = small_world.camera.params.copy()
    params[:2] *= 1.01
    replace(small_world.camera, params=params).save(tmp_path / "bad.h5")
    assert run(["check", str(tmp_path / "bad.h5"), str(photographs), "--board", SmallWorld.spec, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["verdict"] == "wrong"
    assert "--board SPEC" in complaint(capsys, "check", tmp_path / "good.h5", photographs)


def test_check_takes_the_board_that_the_camera_was_calibrated_with(
    camera_file: Path, photographs: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert answer(capsys, "check", camera_file, photographs)["verdict"] == "ok"


@pytest.mark.parametrize(("suffix", "start"), [("svg", b"<svg"), ("pdf", b"%PDF"), ("png", b"\x89PNG")])
def test_a_board_is_drawn_in_the_format_that_its_name_says(suffix: str, start: bytes, tmp_path: Path) -> None:
    path = tmp_path / f"board.{suffix}"
    assert run(["board", "checkerboard:9x6:20mm", "-o", str(path)]) == 0
    assert path.read_bytes().startswith(start)


def test_plugins_and_formats_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    names = {(entry["kind"], entry["name"]) for entry in answer(capsys, "plugins")["plugins"]}
    assert {("solver", "bundle"), ("detector", "checkerboard"), ("board", "charuco")} <= names
    assert {"opencsp", "colmap"} <= {entry["name"] for entry in answer(capsys, "formats")["formats"]}


def test_convert_takes_typed_numbers(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "typed.h5"
    numbers = "fx=2710,fy=2704,cx=853,cy=628,k1=-0.1,k2=0.2,p1=0,p2=0"
    typed = ("--params", numbers, "--model", "opencv4", "--image-size", "1626x1236")
    assert answer(capsys, "convert", *typed, out)["camera"]["params"]["fx"] == 2710
    assert Camera.load(out).params.tolist() == [2710, 2704, 853, 628, -0.1, 0.2, 0, 0]
    assert "lacks k3" in complaint(capsys, "convert", *typed[:3], "opencv5", *typed[4:], out)
    assert "needs --model" in complaint(capsys, "convert", *typed[:4], out)
    assert "NAME=NUMBER" in complaint(capsys, "convert", "--params", "fx=a", *typed[2:], out)


def test_help_and_version_are_quiet() -> None:
    for flag in ("--help", "--version"):
        result = subprocess.run(
            [sys.executable, "-m", "opencsp_calib", flag], capture_output=True, text=True, check=True
        )
        assert result.stdout
        assert result.stderr == ""


def test_help_says_what_a_beginner_would_get_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["calibrate", "--help"]) == 0
    output = capsys.readouterr()
    said = " ".join((output.out + output.err).split())
    assert "inner corners, either way round" in said
    assert "exit code is 0 when there is a camera, even one of which is said last that it should not be used" in said


def test_help_is_quick_as_it_loads_nothing_that_it_does_not_need() -> None:
    command = [sys.executable, "-X", "importtime", "-m", "opencsp_calib", "calibrate", "--help"]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "--board SPEC" in result.stdout
    assert "Solving:" in result.stdout
    for model in LENS_MODELS:
        assert model in " ".join(result.stdout.split())
    loaded = set(re.findall(r"\| +(\w+)", result.stderr))
    assert "typer" in loaded
    assert not loaded & {"numpy", "scipy", "cv2", "matplotlib", "h5py", "rich", "nicegui", "distributed"}


def test_no_command_at_all_is_answered_with_the_help() -> None:
    result = subprocess.run([sys.executable, "-m", "opencsp_calib"], capture_output=True, text=True)
    assert result.returncode == 2
    assert "Commands:" in result.stderr
    assert "error:" not in result.stderr
