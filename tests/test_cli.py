"""The command line's main job: from photographs to a camera file and a report."""

import json
import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest
from camera_files import assert_same_files
from command_line import QUICK, answer, complaint
from worlds import SmallWorld

from opencsp_calib.cli import run
from opencsp_calib.hdf5_calibration import load_calibration, load_observations


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
    small_world: SmallWorld, camera_file: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shown = answer(capsys, "show", camera_file)
    sigma = np.array([shown["sigma"][name] for name in shown["params"]])
    error = np.array(list(shown["params"].values())) - small_world.camera.params
    assert (np.abs(error) < 5 * sigma).all()
    assert (sigma[:4] < 1.0).all()
    assert load_calibration(camera_file).record == {"aperture": "f/8", "pixel_pitch_um": "4.4"}


def test_the_json_of_calibrate_is_as_documented(photographs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    printed = answer(capsys, "calibrate", photographs, "--board", SmallWorld.spec, *QUICK)
    assert list(printed["camera"]["params"]) == ["fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"]
    assert list(printed["camera"]["sigma"]) == list(printed["camera"]["params"])
    assert printed["output"] is None
    assert printed["camera"]["name"] == photographs.name


def test_solving_a_camera_file_again_repeats_the_run(camera_file: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.h5"
    assert run(["solve", str(camera_file), "-o", str(again)]) == 0
    assert_same_files(again, camera_file)


def test_detect_then_solve_is_calibrate(photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    seen, out = tmp_path / "seen.h5", tmp_path / "c.h5"
    printed = answer(capsys, "detect", photographs, "--board", SmallWorld.spec, "-o", seen)
    assert {view["status"] for view in printed["views"]} == {"used"}
    solved = answer(capsys, "solve", seen, "-o", out, *QUICK)
    whole = answer(capsys, "calibrate", photographs, "--board", SmallWorld.spec, *QUICK)
    assert solved["camera"]["params"] == whole["camera"]["params"]
    assert solved["output"] == str(out)


def test_whether_to_use_it_is_said_last(camera_file: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for command in ("show", "solve"):
        assert run([command, str(camera_file)]) == 0
        lines = [line for line in capsys.readouterr().err.splitlines() if "not saved" not in line]
        assert lines[-1].startswith("A good calibration: ")


def test_how_corners_are_weighed_is_asked_for_and_kept(camera_file: Path, tmp_path: Path) -> None:
    for asked, weights, robust in (("--weights=equal --no-robust", "equal", False), ("--robust", "covariance", True)):
        out = tmp_path / "c.h5"
        assert run(["solve", str(camera_file), "--solver", "bundle", *asked.split(), "-o", str(out)]) == 0
        options = load_calibration(out).options
        assert (options.weights, options.robust) == (weights, robust)


@pytest.mark.parametrize("asked", ["text", [1], {"progress": 1, "bogus": 2}, {"model": ["opencv4"]}])
def test_a_file_that_asks_for_nonsense_is_solved_by_what_is_sane_of_it(asked, camera_file, tmp_path) -> None:
    changed = tmp_path / "c.h5"
    shutil.copy(camera_file, changed)
    with h5py.File(changed, "a") as file:
        provenance = json.loads(file["Calibration/provenance"][()])
        del file["Calibration/provenance"]
        file["Calibration/provenance"] = json.dumps({**provenance, "asked": asked})
    assert run(["solve", str(changed)]) == 0


def test_what_is_wrong_in_a_calibration_is_told_with_its_file(camera_file: Path, tmp_path: Path, capsys) -> None:
    changed = tmp_path / "c.h5"
    shutil.copy(camera_file, changed)
    with h5py.File(changed, "a") as file:
        del file["Calibration/covariance"]
        file["Calibration/covariance"] = np.eye(3)
    for command in ("show", "solve"):
        assert "c.h5: covariance has shape (3, 3)" in complaint(capsys, command, changed)


def test_how_corners_are_located_is_asked_for(photographs: Path, tmp_path: Path) -> None:
    few = [str(path) for path in sorted(photographs.iterdir())[:1]]
    found = []
    for refine in ("none", "subpix", "model"):
        seen = tmp_path / f"{refine}.h5"
        asked = ["--detector", "checkerboard", "--refine", refine]
        assert run(["detect", *few, "--board", SmallWorld.spec, *asked, "-o", str(seen)]) == 0
        found += load_observations(seen).detections
    assert [detection.covariance is None for detection in found] == [True, True, False]
    off = [np.abs(detection.pixels - found[-1].pixels).max() for detection in found]
    assert off[0] > off[1] > off[2] == 0


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
    assert "at least 3 must be" in complaint(capsys, *base, "--drop-worst", 10)
    assert "no image 'none.png'" in complaint(capsys, *base, "--exclude", "none.png")
