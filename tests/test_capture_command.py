"""The command that takes photographs: it goes on where it stopped, and loses nothing, whatever stops it."""

import itertools
import os
import shlex
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import numpy as np
import pytest
from worlds import SmallWorld

from opencsp_calib.cli import run
from opencsp_calib.counted import counted
from opencsp_calib.images import ImageFile, read_image, write_image
from opencsp_calib.rendering import render

SPEC = SmallWorld.spec
COMMAND = [sys.executable, "-m", "opencsp_calib", "capture"]
COUNT = 4  # of photographs: after each of them the coach learns, which takes a second


@pytest.fixture(scope="module")
def incoming(photographs, tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("incoming")
    for photograph in sorted(photographs.iterdir())[:COUNT]:
        shutil.copyfile(photograph, folder / photograph.name)
    return folder


def capture(folder: Path, incoming: Path, *more: str) -> int:
    options = ["--source", "folder", "--device", str(incoming), "--set", "wait=0", *more]
    return run(["capture", str(folder), "--board", SPEC, *options])


def test_a_folder_becomes_a_set_and_the_next_command_is_said(incoming, tmp_path, capsys, monkeypatch):
    assert capture(tmp_path / "my set", incoming, "--release", "interval:0", "--count", "3") == 0
    said = capsys.readouterr().err
    assert "3 of 3 photographs" in said
    assert f"opencsp-calib calibrate '{tmp_path / 'my set'}' --board {SPEC} -o 'my set.h5'" in said
    assert "second, independent set" in said
    command = next(line for line in said.splitlines() if "opencsp-calib calibrate" in line)
    monkeypatch.chdir(tmp_path)
    assert run(shlex.split(command[command.index("opencsp-calib") :])[1:]) == 0
    assert (tmp_path / "my set.h5").is_file()


def test_it_goes_on_where_it_stopped_and_takes_no_file_twice(incoming, tmp_path, capsys):
    for count, taken in ((2, 2), (50, COUNT), (50, COUNT)):
        assert capture(tmp_path, incoming, "--release", "interval:0", "--count", str(count)) == 0
        assert len(list(tmp_path.glob("*.png"))) == taken
    assert f"has {COUNT} photographs already: going on from there" in capsys.readouterr().err


def test_a_full_disk_stops_it_with_nothing_lost(incoming, tmp_path, capsys):
    if os.name != "posix" or os.geteuid() != 0:
        pytest.skip("only root can mount a small file system")
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=300k", "tmpfs", disk], capture_output=True).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        assert capture(disk / "set", incoming, "--release", "interval:0") == 2
        said = capsys.readouterr().err
        names = sorted(path.name for path in (disk / "set").iterdir())
        images = [name for name in names if name.endswith(".png")]
        assert 1 <= len(images) < COUNT
        for name in images:
            read_image(ImageFile(name, disk / "set" / name))
        assert not [name for name in names if name.startswith(".")]
        assert "No space left on device" in said
        assert f"{counted(len(images), 'photograph is', 'photographs are')} safe in" in said
        subprocess.run(["mount", "-o", "remount,size=20m", disk], check=True)
        assert capture(disk / "set", incoming, "--release", "interval:0", "--count", str(COUNT)) == 0
        assert len(list((disk / "set").glob("*.png"))) == COUNT
    finally:
        subprocess.run(["umount", "-l", disk], check=True)


def started(folder: Path, incoming: Path, *more: str) -> subprocess.Popen:
    options = ["--board", SPEC, "--source", "folder", "--device", str(incoming), *more]
    return subprocess.Popen([*COMMAND, str(folder), *options], stdin=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def wait_for(process: subprocess.Popen, words: str) -> str:
    for line in process.stderr:
        if words in line:
            return line
    raise AssertionError(f"it ended without {words!r}")


@pytest.mark.skipif(os.name != "posix", reason="kills with a signal")
def test_killed_in_the_middle_it_has_lost_nothing_and_goes_on(incoming, tmp_path):
    with started(tmp_path / "set", incoming, "--release", "interval:0") as process:
        wait_for(process, "0002.png: 2 of 50")
        process.send_signal(signal.SIGKILL)
    images = sorted((tmp_path / "set").glob("[0-9]*.png"))
    assert len(images) >= 2
    for path in images:
        read_image(ImageFile(path.name, path))
    assert capture(tmp_path / "set", incoming, "--release", "interval:0", "--count", str(COUNT)) == 0
    assert len(list((tmp_path / "set").glob("*.png"))) == COUNT


def test_keys_release_delete_and_stop(small_world, tmp_path):
    """Written to its standard input, as a person's program does; on a terminal they need no Enter."""
    incoming = tmp_path / "incoming"
    incoming.mkdir()
    source = render(small_world.camera, small_world.board, small_world.poses[0], samples=2)
    over = threading.Event()

    def deliver() -> None:
        for number in itertools.count():
            write_image(source.pixels + np.uint8(number % 200), incoming / f"{number}.png")
            if over.wait(0.2):
                return

    camera = threading.Thread(target=deliver)
    with started(tmp_path / "set", incoming, "--release", "manual", "--set", "wait=300") as process:
        camera.start()
        try:
            for number, key in enumerate((" ", "\n", " "), start=1):
                process.stdin.write(key)
                process.stdin.flush()
                wait_for(process, f"000{number}.png: {number} of 50")
            process.stdin.write("dq")
            process.stdin.flush()
            assert "2 of 50 photographs are in" in process.stderr.read()
        finally:
            over.set()
            camera.join()
    assert process.returncode == 0


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--release", "often"], "--release takes"),
        (["--goal", "0"], "'--goal'"),
        (["--range", "-1"], "'--range'"),
        (["--set", "ExposureTime"], "--set takes FEATURE=VALUE"),
        (["--source", "nikon"], "no image source is called 'nikon'"),
        (["--device", "nowhere"], "there is no folder 'nowhere'"),
        (["--board", "checkerboard:9x6"], "checkerboard:COLUMNSxROWS:SIZE"),
    ],
)
def test_wrong_use_is_one_line(tmp_path, capsys, options, message):
    asked = ["capture", str(tmp_path / "set"), "--board", SPEC, "--source", "folder", *options]
    assert run(asked) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    assert message in said[0]


def test_images_are_not_taken_from_the_set_itself(incoming, capsys):
    assert capture(incoming, incoming) == 2
    assert "into the same folder" in capsys.readouterr().err
