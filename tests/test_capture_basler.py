"""From Basler's emulated camera to a camera file: Sandia's photographs as the scene, by the command line alone."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from opencsp_calib import Camera
from opencsp_calib.cli import run
from opencsp_calib.comparison import compare
from opencsp_calib.images import find_images, read_image

pytest.importorskip("pypylon", reason="Basler's SDK is not installed")
pytestmark = pytest.mark.usefixtures("emulated_cameras")

SPEC = "checkerboard:18x23:50mm"
COMMAND = [sys.executable, "-m", "opencsp_calib", "capture"]


def emulated(cameras: int) -> dict[str, str]:
    return {**os.environ, "PYLON_CAMEMU": str(cameras)}


def captured(folder: Path, *more: object, cameras: int = 2, **options) -> subprocess.CompletedProcess:
    """The command, in a process of its own, since the SDK reads its environment once."""
    command = [*COMMAND, str(folder), "--board", SPEC, *map(str, more)]
    return subprocess.run(
        command, env=emulated(cameras), capture_output=True, text=True, stdin=subprocess.DEVNULL, **options
    )


def test_sandias_photographs_through_the_camera_to_a_camera_file(data_dir: Path, tmp_path: Path) -> None:
    """Photographs come bit for bit through the camera, and the camera file is that of the files themselves."""
    scene = tmp_path / "scene"
    scene.mkdir()
    # a prime number: also where every second or third frame is missed, all come in time
    for path in sorted((data_dir / "sandia_checkerboard").glob("*.png"))[:5]:
        (scene / path.name).write_bytes(path.read_bytes())
    settings = {"ImageFilename": scene, "ImageFileMode": "On", "TestImageSelector": "Off", "AcquisitionFrameRate": 2}
    asked = [word for name, value in settings.items() for word in ("--set", f"{name}={value}")]
    done = captured(tmp_path / "set", "--release", "interval:0", "--count", 7, "--device", "0815-0001", *asked)
    assert done.returncode == 0, done.stderr
    assert "TestImageSelector = Off, AcquisitionFrameRate = 2.00, OffsetX = 0, OffsetY = 0, Width = 4096" in done.stderr
    assert "opencsp-calib calibrate" in done.stderr
    assert "second, independent set" in done.stderr
    true = {read_image(file).pixels.tobytes(): file.name for file in find_images(scene)}
    taken = {file.name: read_image(file).pixels.tobytes() for file in find_images(tmp_path / "set")}
    assert len(taken) == 7
    assert set(taken.values()) <= set(true)
    record = json.loads((tmp_path / "set" / "0001.json").read_text())
    assert (record["device"], record["settings"]["Width"], record["settings"]["BinningVertical"]) == (
        "0815-0001",
        "1626",
        "1",
    )
    seen = sorted({true[pixels] for pixels in taken.values()})
    for images, output in ((["set"], "captured.h5"), ([f"scene/{name}" for name in seen], "direct.h5")):
        paths = [str(tmp_path / image) for image in images]
        assert run(["calibrate", *paths, "--board", SPEC, "-o", str(tmp_path / output)]) == 0
    captured_camera, direct = (Camera.load(tmp_path / name) for name in ("captured.h5", "direct.h5"))
    assert compare(captured_camera, direct).worst_px < 1e-3


def test_no_camera_is_one_sentence(tmp_path: Path) -> None:
    done = captured(tmp_path / "set", cameras=0)
    assert done.returncode == 2
    assert done.stderr.startswith("error: no Basler camera is connected: check cable")
    assert len(done.stderr.splitlines()) == 1


def test_a_camera_in_use_frames_that_fail_and_no_trigger_are_one_sentence_each(tmp_path: Path) -> None:
    small = ["--device", "0815-0000", "--set", "Width=64", "--set", "Height=48", "--release", "interval:0"]
    holder = [*COMMAND, str(tmp_path / "one"), "--board", SPEC, *small, "--count", "100000"]
    with subprocess.Popen(holder, env=emulated(2), stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True) as held:
        try:
            assert any(line.startswith("0001.png") for line in held.stderr)
            busy = captured(tmp_path / "two", *small)
        finally:
            held.kill()
    assert busy.returncode == 2
    assert "error: the camera 0815-0000 is in use by another program" in busy.stderr
    failing = captured(tmp_path / "three", *small, "--set", "ForceFailedBuffer=1", "--set", "ExposureTime=1000")
    assert failing.returncode == 2
    assert "error: 30 frames in a row of camera 0815-0000 were incomplete" in failing.stderr.splitlines()[-1]
    silent = captured(tmp_path / "four", *small, "--set", "TriggerMode=On")
    assert silent.returncode == 2
    assert "it waits for a trigger (Software); send one, or --set TriggerMode=Off" in silent.stderr.splitlines()[-1]
