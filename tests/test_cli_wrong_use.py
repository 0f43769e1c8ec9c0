"""Every way to get the command line wrong: one line says what, where, and what to do."""

import json
import os
import re
import shutil
import stat
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_line import QUICK, answer, complaint
from worlds import SmallWorld

from opencsp_calib import pipeline
from opencsp_calib.cli import run
from opencsp_calib.hdf5_calibration import load_calibration, load_observations, save_observations
from opencsp_calib.images import write_image


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
        ("18x23", "write checkerboard:COLUMNSxROWS:SIZE or charuco:"),
        ("checkerboard:9x6", "size of a square"),
        ("checkerboard:9x6:30", "has no unit"),
        ("checkerboard:9:30mm", "'9', is not two whole numbers with an x between them"),
        ("checkerboard:9x6:30mm:extra", "checkerboard:COLUMNSxROWS:SIZE"),
        ("charuco:4x5:54mm:40mm:DICT_NONE", "DICT_4X4_50"),
        ("dots:4x5:3mm", "write checkerboard:COLUMNSxROWS:SIZE or charuco:"),
        ("missing.json", "missing.json cannot be read: No such file"),
        ("board.yaml", "the name of a board file (.json)"),
    ],
)
def test_a_wrong_board_says_how_it_is_written(spec: str, words: str, photographs: Path, capsys) -> None:
    assert words in complaint(capsys, "calibrate", photographs, "--board", spec)


def test_columns_and_rows_swapped_are_the_same_board_turned(photographs: Path, capsys) -> None:
    """A plain checkerboard of 6x9 is one of 9x6 seen from the side: nothing tells them apart, and nothing needs to."""
    named = [
        answer(capsys, "calibrate", photographs, "--board", f"checkerboard:{size}:30mm") for size in ("9x6", "6x9")
    ]
    values = [np.array(list(printed["camera"]["params"].values())) for printed in named]
    np.testing.assert_allclose(values[0], values[1], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    "command",
    [
        ("fleet", "", "--board", SmallWorld.spec),
        ("calibrate", "", "--board", SmallWorld.spec),
        ("calibrate", ".", "--board", SmallWorld.spec, "--output="),
        ("gui", ""),
        ("show", " "),
        ("demo", ""),
    ],
)
def test_an_empty_path_is_not_the_current_folder(command: tuple[str, ...], tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    place = "--output" if "--output=" in command else command[0]
    assert f"nothing is given after {place}, only an empty text" in complaint(capsys, *command)
    assert not list(tmp_path.iterdir())


def test_an_observations_file_is_not_named_as_something_else(tmp_path: Path, capsys) -> None:
    said = complaint(capsys, "detect", tmp_path, "--board", SmallWorld.spec, "-o", tmp_path / "seen.csv")
    assert "seen.csv would be HDF5 under another name: let its name end in .h5" in said


@pytest.mark.parametrize("name", ["camera.yaml", "camera.JSON", "camera.txt", "camera.png", "camera.html"])
def test_a_camera_file_is_not_named_like_another_format(name, tmp_path: Path, capsys) -> None:
    said = complaint(capsys, "calibrate", tmp_path, "--board", SmallWorld.spec, "-o", tmp_path / name)
    assert "let its name end in .h5" in said
    assert "convert" in said


def test_a_report_is_named_as_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in (["calibrate", tmp_path, "--board", SmallWorld.spec], ["validate", tmp_path]):
        assert "let its name end in .html" in complaint(capsys, *command, "--report", tmp_path / "report.pdf")


def test_no_board_anywhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for index in range(3):
        write_image(np.full((480, 640), 60 + index, np.uint8), tmp_path / f"{index}.png")
    assert "in 3 images" in complaint(capsys, "calibrate", tmp_path, "--board", SmallWorld.spec)
    seen = tmp_path / "seen.h5"
    assert "in 3 images" in complaint(capsys, "detect", tmp_path, "--board", SmallWorld.spec, "-o", seen)
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
    assert "is a folder" in complaint(capsys, "solve", photographs)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_may_not_be_written(photographs: Path, tmp_path: Path, capsys) -> None:
    tmp_path.chmod(stat.S_IRUSR | stat.S_IXUSR)
    line = complaint(capsys, "calibrate", photographs, "--board", SmallWorld.spec, "-o", tmp_path / "c.h5")
    assert "no permission" in line


def test_foreign_and_damaged_files_say_what_they_are(
    camera_file: Path, photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with h5py.File(tmp_path / "foreign.h5", "w") as file:
        file["Data/x"] = 3
    seen = tmp_path / "seen.h5"
    save_observations(load_observations(camera_file), seen)
    whole = camera_file.read_bytes()
    (tmp_path / "cut.h5").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "cut").write_bytes(whole[: len(whole) // 2])
    (tmp_path / "changed.h5").write_bytes(whole[:3000] + b"\xff\xfe" + whole[3002:])
    (tmp_path / "empty.h5").write_bytes(b"")
    (tmp_path / "text.h5").write_text("hello")
    board = ("--board", SmallWorld.spec)
    for name, words in (
        ("foreign.h5", "has no (group /Camera|observations)"),
        ("cut.h5", r"is a damaged HDF5 file: use another copy of it \(truncated file"),
        ("cut", r"is a damaged HDF5 file: use another copy of it \(truncated file"),
        ("changed.h5", "is damaged: its checksum does not fit its contents; use another copy of it"),
        ("empty.h5", "is empty: use another copy of it"),
        ("text.h5", "is not HDF5, .*: it is damaged, or another file is meant"),
        ("seen.h5", "holds what was seen .*, but no camera: `opencsp-calib solve .*seen.h5 -o camera.h5` calibrates"),
    ):
        file = tmp_path / name
        for command in (
            ("show", file),
            ("compare", file, camera_file),
            ("convert", file, tmp_path / "c.yaml"),
            ("check", file, photographs),
            ("solve", file),
            ("validate", file),
            ("calibrate", photographs, *board, "--guess", file),
        ):
            if name != "seen.h5" or command[0] not in ("solve", "validate"):
                assert re.search(f"{name}:? ({words})", complaint(capsys, *command)), command


def test_a_result_does_not_take_the_place_of_what_it_is_made_from(camera_file: Path, capsys) -> None:
    for command in (["convert", camera_file, camera_file], ["solve", camera_file, "-o", camera_file]):
        assert "is itself what is read" in complaint(capsys, *command)
    assert load_calibration(camera_file)


def test_what_no_solution_can_come_of_is_said_before_any_image_is_looked_at(monkeypatch, photographs, capsys) -> None:
    monkeypatch.setattr(pipeline, "detect", None)
    for wrong in (["--model", "opencv6"], ["--solver", "magic"], ["--pixel-aspect", "-1"]):
        assert wrong[1] in complaint(capsys, "calibrate", photographs, "--board", SmallWorld.spec, *wrong)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--exclude", "none.png"], "no image 'none.png' to exclude; there are 01.png"),
        (["--drop-worst", 10], "2 of 12 images would be left: at least 3 must be"),
        (["--drop-worst", 99], "0 of 12 images would be left"),
        (["--drop-worst", 3, "--select", 5], "2 of 12 images would be left"),
        (["--drop-worst", 9, "--exclude", "01.png"], "2 of 12 images would be left"),
    ],
)
def test_what_cannot_be_left_out_is_said_before_any_image_is_looked_at(
    options: list[object], words: str, photographs: Path, monkeypatch: pytest.MonkeyPatch, capsys
) -> None:
    monkeypatch.setattr(pipeline, "detect", None)
    assert words in complaint(capsys, "calibrate", photographs, "--board", SmallWorld.spec, *options)


def test_undistorting_nothing_leaves_no_folder(camera_file: Path, tmp_path: Path, capsys) -> None:
    write_image(np.full((48, 64), 60, np.uint8), tmp_path / "small.png")
    complaint(capsys, "undistort", camera_file, tmp_path / "small.png", "-o", tmp_path / "new")
    assert not (tmp_path / "new").exists()


def test_wrong_use(photographs: Path, camera_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    base = ("calibrate", photographs, "--board", SmallWorld.spec)
    without_board = complaint(capsys, "calibrate", photographs)
    assert "--board" in without_board
    assert "checkerboard:18x23:50mm" in without_board
    assert "opencv6" in complaint(capsys, "calibrate", photographs, "--board", SmallWorld.spec, "--model", "opencv6")
    assert "'magic'" in complaint(capsys, *base, "--solver", "magic")
    assert "bundle" in complaint(capsys, *base, "--solver", "opencv", "--board-shape", "free")
    said = complaint(capsys, *base, "--preset", "opencsp", "--solver", "mrcal")
    assert "means --solver opencv; leave out --solver mrcal" in said
    assert "means --no-robust; leave out --robust" in complaint(capsys, *base, "--preset", "opencsp", "--robust")
    assert "KEY=VALUE" in complaint(capsys, *base, "--note", "f8")
    assert "free, square or a number" in complaint(capsys, *base, "--pixel-aspect", "round")
    assert "able are: checkerboard, opencsp" in complaint(capsys, *base, "--detector", "charuco")
    assert "'--weights': 'heavy' is not one of" in complaint(capsys, *base, "--weights", "heavy")
    assert "no such file" in complaint(capsys, "validate", "none")
    assert "leave out --board" in complaint(capsys, "validate", camera_file, "--board", SmallWorld.spec)
    assert "installed are: bundle" in complaint(capsys, "validate", camera_file, "--solvers", ",")
    assert "with --params only OUT" in complaint(capsys, "convert", "--params", "fx=1")
    assert "--fit" in complaint(capsys, "convert", camera_file, "x.h5", "--model", "opencv5")
    assert complaint(capsys, *base, "--guess", "none.h5").endswith("none.h5 does not exist")
    assert "text was expected" in complaint(capsys, "show", camera_file, "--from", "kalibr")
    assert "'--views'" in complaint(capsys, "demo", "--views", 2)
    assert "WIDTHxHEIGHT" in complaint(capsys, "show", camera_file, "--image-size", "big")
    assert "'nonsense'" in complaint(capsys, "nonsense")
    assert ".png, .svg or .pdf" in complaint(capsys, "compare", camera_file, camera_file, "--plot", "x.gif")


def test_nothing_is_written_when_it_fails(photographs: Path, tmp_path: Path, capsys) -> None:
    out = tmp_path / "c.h5"
    out.write_text("precious")
    complaint(capsys, "calibrate", photographs, "--board", "checkerboard:5x4:30mm", "-o", out)
    assert out.read_text() == "precious"
    assert [path.name for path in tmp_path.iterdir()] == ["c.h5"]


def test_an_interruption_while_it_loads_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "typer.py").write_text("raise KeyboardInterrupt")
    started = [sys.executable, "-m", "opencsp_calib", "formats"]
    ended = subprocess.run(started, env=os.environ | {"PYTHONPATH": str(tmp_path)}, capture_output=True, text=True)
    assert (ended.returncode, ended.stdout, ended.stderr) == (1, "", "error: stopped; nothing was begun\n")


def test_an_interruption_that_a_library_turned_into_an_error_is_one_line(monkeypatch, capsys) -> None:
    def interrupted(*_: object, **__: object) -> None:
        raise TypeError("Cannot compare structured arrays")

    monkeypatch.setattr("opencsp_calib.cli.app", interrupted)
    with pytest.raises(TypeError):
        run(["formats"])
    monkeypatch.setattr("opencsp_calib.stopping._told", [15])
    assert run(["formats"]) == 1
    assert capsys.readouterr().err.startswith("error: stopped")
