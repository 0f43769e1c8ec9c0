"""The command line as people use it: the main job on real and rendered photographs, and every way to get it wrong."""

import json
import os
import re
import shutil
import stat
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from worlds import SmallWorld

from opencsp_calib import Camera
from opencsp_calib.cli import run
from opencsp_calib.hdf5_calibration import load_calibration
from opencsp_calib.images import write_image

QUICK = ("--solver", "opencv")


def answer(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict:
    """The JSON that a command prints; standard output must hold nothing else."""
    code = run([*map(str, arguments), "--json"])
    output = capsys.readouterr()
    assert code == 0, output.err
    return json.loads(output.out)


def complaint(capsys: pytest.CaptureFixture[str], *arguments: object, code: int = 2) -> str:
    """What a command that fails says: one line at the end, no traceback, nothing on standard output."""
    assert run([*map(str, arguments)]) == code
    output = capsys.readouterr()
    assert output.out == ""
    assert "Traceback" not in output.err
    last = output.err.strip().splitlines()[-1]
    assert last.startswith("error: ")
    return last


@pytest.fixture(scope="module")
def calibrated(photographs: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calibrated")
    command = ["calibrate", str(photographs), "--board", SmallWorld.spec, "-o", str(folder / "camera.h5")]
    assert run([*command, "--note", "aperture=f/8", "--pixel-pitch", "4.4"]) == 0
    return folder / "camera.h5"


# --- the main job -----------------------------------------------------------------------------------------------------


def test_preset_opencsp_does_exactly_the_seeds_way(
    data_dir: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = data_dir / "sandia_checkerboard"
    out = tmp_path / "camera.h5"
    board = "checkerboard:18x23:50mm"
    printed = answer(capsys, "calibrate", folder, "--board", board, "--preset", "opencsp", "-o", out)
    with h5py.File(folder / "expected_opencsp.h5") as expected:
        found = load_calibration(out)
        corners = np.stack([detection.pixels.T for detection in found.observations.detections])
        np.testing.assert_allclose(corners, expected["p_image_points"][()], rtol=0, atol=1e-3)
        np.testing.assert_allclose(found.camera.matrix, expected["intrinsic_matrix"][()], rtol=0, atol=1e-3)
        np.testing.assert_allclose(found.camera.distortion, expected["distortion_coeffs"][()], rtol=0, atol=1e-6)
        assert printed["rms_px"] == pytest.approx(float(expected["calibration_error"][()]), abs=1e-6)
        views = [view["rms_px"] for view in printed["views"]]
        np.testing.assert_allclose(views, expected["reprojection_errors"][()], rtol=0, atol=1e-5)
    assert printed["camera"]["image_size"] == [1626, 1236]
    with h5py.File(out) as written:
        assert written["Camera/image_shape_xy"][()].tolist() == [1626, 1236]


def test_a_rendered_camera_is_found(
    small_world: SmallWorld, calibrated: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = answer(capsys, "show", calibrated)
    sigma = np.array([shown["sigma"][name] for name in shown["params"]])
    error = np.array(list(shown["params"].values())) - small_world.camera.params
    assert (np.abs(error) < 5 * sigma).all()
    assert (sigma[:4] < 1.0).all()
    assert load_calibration(calibrated).record == {"aperture": "f/8", "pixel_pitch_um": "4.4"}


def test_the_json_of_calibrate_is_as_documented(photographs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed = answer(capsys, "calibrate", photographs, "--board", SmallWorld.spec, *QUICK)
    assert set(printed) == {
        "camera", "solver", "rms_px", "rejected_corners", "board_shape", "pixel_aspect", "views", "warnings", "seconds",
        "output",
    }  # fmt: skip
    assert set(printed["camera"]) == {"name", "model", "image_size", "params", "sigma"}
    assert list(printed["camera"]["params"]) == ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"]
    assert list(printed["camera"]["sigma"]) == list(printed["camera"]["params"])
    assert set(printed["views"][0]) == {
        "image", "status", "corners", "rms_px", "tilt_deg", "edge_width_px", "problems",
    }  # fmt: skip
    assert printed["output"] is None
    assert set(printed["seconds"]) == {"detect", "solve", "total"}
    assert printed["camera"]["name"] == photographs.name


def test_solving_a_camera_file_again_repeats_the_run(calibrated: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.h5"
    assert run(["solve", str(calibrated), "-o", str(again)]) == 0

    def content(path: Path) -> dict:
        values = {}
        with h5py.File(path) as file:
            file.visititems(
                lambda name, item: values.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None
            )
        values.pop("Calibration/provenance")
        return values

    first, second = content(calibrated), content(again)
    assert first.keys() == second.keys()
    for name in first:
        np.testing.assert_array_equal(first[name], second[name], err_msg=name)


def test_detect_then_solve_is_calibrate(photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seen, out = tmp_path / "seen.h5", tmp_path / "c.h5"
    printed = answer(capsys, "detect", photographs, "--board", SmallWorld.spec, "-o", seen)
    assert {view["status"] for view in printed["views"]} == {"used"}
    solved = answer(capsys, "solve", seen, "-o", out, *QUICK)
    whole = answer(capsys, "calibrate", photographs, "--board", SmallWorld.spec, *QUICK)
    assert solved["camera"]["params"] == whole["camera"]["params"]
    assert solved["output"] == str(out)


def test_the_report_is_one_file_that_needs_no_other(photographs: Path, tmp_path: Path) -> None:
    report = tmp_path / "r.html"
    command = ["calibrate", str(photographs), "--board", SmallWorld.spec, "--report", str(report), "--drop-worst", "2"]
    assert run([*command, *QUICK]) == 0
    page = report.read_text(encoding="utf-8")
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page
    for words in ("Dropped images", "2 dropped", "Each view, in order of capture", "The five worst", "Provenance"):
        assert words in page
    assert page.count("data:image/jpeg;base64") == 12
    assert page.count('<figure class="view"') == 12


def test_dropping_images(photographs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    base = ("calibrate", photographs, "--board", SmallWorld.spec, *QUICK)
    excluded = answer(capsys, *base, "--exclude", "03.png", "--exclude", "04.png")
    assert [v["image"] for v in excluded["views"] if v["status"] == "dropped"] == ["03.png", "04.png"]
    everything = answer(capsys, *base)
    worst = max(everything["views"], key=lambda view: view["rms_px"])
    dropped = answer(capsys, *base, "--drop-worst", 1)
    assert [v["image"] for v in dropped["views"] if v["status"] == "dropped"] == [worst["image"]]
    limited = answer(capsys, *base, "--max-rms", worst["rms_px"] - 1e-9)
    assert worst["image"] in [v["image"] for v in limited["views"] if v["status"] == "dropped"]
    assert "at least 3 must be left" in complaint(capsys, *base, "--drop-worst", 10)
    assert "no image 'none.png'" in complaint(capsys, *base, "--exclude", "none.png")


# --- the other commands -----------------------------------------------------------------------------------------------


def test_compare_says_how_far_apart(small_world: SmallWorld, calibrated: Path, tmp_path: Path, capsys) -> None:
    small_world.camera.save(tmp_path / "truth.h5")
    plot = tmp_path / "difference.png"
    printed = answer(capsys, "compare", calibrated, tmp_path / "truth.h5", "--plot", plot)
    assert set(printed) == {"rms_px", "median_px", "worst_px", "rotation_deg", "range_m"}
    assert printed["worst_px"] < 0.2
    assert printed["range_m"] is None
    assert plot.read_bytes().startswith(b"\x89PNG")
    assert answer(capsys, "compare", calibrated, calibrated, "--range", 2)["worst_px"] < 1e-9


def test_undistort_writes_images(calibrated: Path, photographs: Path, tmp_path: Path, capsys) -> None:
    assert run(["undistort", str(calibrated), str(photographs), "-o", str(tmp_path / "flat")]) == 0
    assert len(list((tmp_path / "flat").iterdir())) == 12
    assert "another folder" in complaint(capsys, "undistort", calibrated, photographs, "-o", photographs)


def test_validate_lets_solvers_answer_without_images(calibrated: Path, tmp_path: Path, capsys) -> None:
    report = tmp_path / "v.html"
    printed = answer(capsys, "validate", calibrated, "--solvers", "bundle,opencv", "--report", report)
    assert set(printed) == {"solvers", "differences", "halves", "held_out", "models", "verdict", "reasons"}
    assert set(printed["solvers"]) == {"bundle", "opencv"}
    assert set(printed["solvers"]["opencv"]) == {"version", "rms_px", "params", "seconds"}
    assert set(printed["differences"][0]) == {"a", "b", "rms_px", "worst_px", "agree"}
    assert printed["differences"][0]["worst_px"] < 1e-4
    assert set(printed["halves"]) == {"median_px", "worst_px", "predicted_px"}
    assert printed["verdict"] == "agree"
    assert "The solvers agree" in report.read_text(encoding="utf-8")


def test_check_tells_a_good_camera_from_a_bad_one(
    small_world: SmallWorld, photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    small_world.camera.save(tmp_path / "good.h5")
    printed = answer(capsys, "check", tmp_path / "good.h5", photographs, "--board", SmallWorld.spec)
    assert set(printed) == {"rms_px", "worst_px", "predicted_px", "verdict"}
    assert printed["verdict"] == "ok"
    params = small_world.camera.params.copy()
    params[:2] *= 1.01
    replace(small_world.camera, params=params).save(tmp_path / "bad.h5")
    assert run(["check", str(tmp_path / "bad.h5"), str(photographs), "--board", SmallWorld.spec, "--json"]) == 1
    assert json.loads(capsys.readouterr().out)["verdict"] == "wrong"
    assert "--board SPEC" in complaint(capsys, "check", tmp_path / "good.h5", photographs)


def test_check_takes_the_board_that_the_camera_was_calibrated_with(
    photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer(capsys, "calibrate", photographs, "--board", SmallWorld.spec, "-o", tmp_path / "camera.h5")
    assert answer(capsys, "check", tmp_path / "camera.h5", photographs)["verdict"] == "ok"


@pytest.mark.parametrize("suffix", ["svg", "pdf", "png"])
def test_a_board_is_drawn(suffix: str, tmp_path: Path) -> None:
    path = tmp_path / f"board.{suffix}"
    assert run(["board", "checkerboard:9x6:20mm", "-o", str(path)]) == 0
    assert path.stat().st_size > 500


def test_plugins_and_formats_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    names = {(entry["kind"], entry["name"]) for entry in answer(capsys, "plugins")}
    assert {("solver", "bundle"), ("detector", "checkerboard"), ("board", "charuco")} <= names
    assert {"opencsp", "colmap"} & {entry["name"] for entry in answer(capsys, "formats")}


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


def test_help_is_quick_as_it_loads_nothing_that_it_does_not_need() -> None:
    command = [sys.executable, "-X", "importtime", "-m", "opencsp_calib", "calibrate", "--help"]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "--board SPEC" in result.stdout
    assert "Solving:" in result.stdout
    loaded = set(re.findall(r"\| +(\w+)", result.stderr))
    assert "typer" in loaded
    assert not loaded & {"numpy", "scipy", "cv2", "matplotlib", "h5py", "numba", "rich", "nicegui", "distributed"}


def test_no_command_at_all_is_answered_with_the_help() -> None:
    result = subprocess.run([sys.executable, "-m", "opencsp_calib"], capture_output=True, text=True)
    assert result.returncode == 2
    assert "Commands:" in result.stderr
    assert "error:" not in result.stderr


# --- bad input --------------------------------------------------------------------------------------------------------


def garbage(folder: Path, photographs: Path, how: str) -> None:
    shutil.copytree(photographs, folder, dirs_exist_ok=True)
    if how == "empty":
        (folder / "05.png").write_bytes(b"")
    elif how == "cut":
        (folder / "05.png").write_bytes((folder / "05.png").read_bytes()[:3000])
    elif how == "text":
        (folder / "05.png").write_text("not an image")
    elif how == "size":
        write_image(np.full((300, 400), 90, np.uint8), folder / "05.png")
    elif how == "twice":
        shutil.copy(folder / "01.png", folder / "05.png")
    elif how == "no board":
        write_image(np.full((480, 640), 90, np.uint8), folder / "05.png")


@pytest.mark.parametrize(
    ("how", "status"),
    [
        ("empty", "unreadable"),
        ("cut", "unreadable"),
        ("text", "unreadable"),
        ("size", "wrong size"),
        ("twice", "duplicate"),
        ("no board", "no board"),
    ],
)
def test_one_bad_image_is_listed_and_does_not_stop_the_run(
    how: str, status: str, photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    garbage(tmp_path, photographs, how)
    assert run(["calibrate", str(tmp_path), "--board", SmallWorld.spec, "--json", *QUICK]) == 0
    output = capsys.readouterr()
    view = json.loads(output.out)["views"][4]
    assert view["image"] == "05.png"
    assert view["status"] == status
    assert view["problems"]
    assert f"05.png: {status}: " in output.err


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("18x23", "checkerboard:"),
        ("checkerboard:9x6", "size of a square"),
        ("checkerboard:9x6:30", "unit"),
        ("checkerboard:9:30mm", "9x6|COLUMNSxROWS|columns"),
        ("checkerboard:9x6:30mm:extra", "checkerboard:COLUMNSxROWS:SIZE"),
        ("charuco:4x5:54mm:40mm:DICT_NONE", "DICT_4X4_50"),
        ("dots:4x5:3mm", "dots"),
        ("missing.json", "missing.json"),
    ],
)
def test_a_wrong_board_says_how_it_is_written(spec: str, words: str, photographs: Path, capsys) -> None:
    line = complaint(capsys, "calibrate", photographs, "--board", spec)
    assert any(word in line for word in words.split("|")), line


def test_columns_and_rows_swapped_are_the_same_board_turned(photographs: Path, capsys) -> None:
    """A plain checkerboard of 6x9 is one of 9x6 seen from the side: nothing tells them apart, and nothing needs to."""
    named = [
        answer(capsys, "calibrate", photographs, "--board", f"checkerboard:{size}:30mm") for size in ("9x6", "6x9")
    ]
    values = [np.array(list(printed["camera"]["params"].values())) for printed in named]
    np.testing.assert_allclose(values[0], values[1], rtol=0, atol=1e-6)


@pytest.mark.parametrize("name", ["camera.yaml", "camera.JSON", "camera.txt"])
def test_a_camera_file_is_not_named_like_another_format(name, tmp_path: Path, capsys) -> None:
    said = complaint(capsys, "calibrate", tmp_path, "--board", SmallWorld.spec, "-o", tmp_path / name)
    assert "let its name end in .h5" in said
    assert "convert" in said


def test_no_board_anywhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for index in range(3):
        write_image(np.full((480, 640), 60 + index, np.uint8), tmp_path / f"{index}.png")
    assert "in any of the 3 images" in complaint(capsys, "calibrate", tmp_path, "--board", SmallWorld.spec)
    seen = tmp_path / "seen.h5"
    assert "in any of the 3 images" in complaint(capsys, "detect", tmp_path, "--board", SmallWorld.spec, "-o", seen)
    assert not seen.exists()


def test_too_few_views(photographs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    two = sorted(photographs.iterdir())[:2]
    assert "at least 3 views" in complaint(capsys, "calibrate", *two, "--board", SmallWorld.spec)


def test_files_that_are_not_there(photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    board = ("--board", SmallWorld.spec)
    assert "no such file" in complaint(capsys, "calibrate", tmp_path / "none", *board)
    assert "has no image files" in complaint(capsys, "calibrate", tmp_path, *board)
    assert "does not exist" in complaint(capsys, "calibrate", photographs, *board, "-o", tmp_path / "no" / "c.h5")
    assert "does not exist" in complaint(
        capsys, "calibrate", photographs, *board, "--report", tmp_path / "no" / "r.html"
    )
    assert "does not exist" in complaint(capsys, "show", tmp_path / "none.h5")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written(photographs: Path, tmp_path: Path, capsys) -> None:
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    line = complaint(capsys, "calibrate", photographs, "--board", SmallWorld.spec, "-o", tmp_path / "c.h5")
    assert "no permission" in line


def test_foreign_and_damaged_files(calibrated: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["Data/x"] = 3
    damaged = bytearray(calibrated.read_bytes())
    damaged[len(damaged) // 2 :] = b""
    (tmp_path / "damaged.h5").write_bytes(damaged)
    for name in ("foreign.h5", "damaged.h5"):
        assert name in complaint(capsys, "show", tmp_path / name)
        assert name in complaint(capsys, "solve", tmp_path / name)


def test_wrong_use(photographs: Path, calibrated: Path, capsys: pytest.CaptureFixture[str]) -> None:
    base = ("calibrate", photographs, "--board", SmallWorld.spec)
    assert "--board" in complaint(capsys, "calibrate", photographs)
    assert "opencv6" in complaint(capsys, "calibrate", photographs, "--board", SmallWorld.spec, "--model", "opencv6")
    assert "'magic'" in complaint(capsys, *base, "--solver", "magic")
    assert "bundle" in complaint(capsys, *base, "--solver", "opencv", "--board-shape", "free")
    assert "--solver" in complaint(capsys, *base, "--preset", "opencsp", "--solver", "mrcal")
    assert "KEY=VALUE" in complaint(capsys, *base, "--note", "f8")
    assert "free, square or a number" in complaint(capsys, *base, "--pixel-aspect", "round")
    assert "WIDTHxHEIGHT" in complaint(capsys, "show", calibrated, "--image-size", "big")
    assert complaint(capsys, "nonsense")
    assert ".png, .svg or .pdf" in complaint(capsys, "compare", calibrated, calibrated, "--plot", "x.gif")


def test_nothing_is_written_when_it_fails(photographs: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "c.h5"
    out.write_text("precious")
    complaint(capsys, "calibrate", photographs, "--board", "checkerboard:5x4:30mm", "-o", out)
    assert out.read_text() == "precious"
    assert [path.name for path in tmp_path.iterdir()] == ["c.h5"]


def test_an_interruption_that_a_library_turned_into_an_error_is_one_line(monkeypatch, capsys) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise TypeError("Cannot compare structured arrays")

    monkeypatch.setattr("opencsp_calib.cli.app", interrupted)
    with pytest.raises(TypeError):
        run(["formats"])
    monkeypatch.setattr("opencsp_calib.cli.stopping._told", [15])
    assert run(["formats"]) == 1
    assert capsys.readouterr().err.startswith("error: stopped")
