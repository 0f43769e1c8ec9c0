"""A capture: photographs at the right moments and only then, whole on the disk whatever happens."""

import itertools
import json
import os
import signal
import subprocess
import sys
import threading
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import SmallWorld

from opencsp_calib import InputError, Pose
from opencsp_calib.capture import Capture, CaptureFolder, Release, release_from
from opencsp_calib.cli import run
from opencsp_calib.image import Image
from opencsp_calib.images import ImageFile, read_image, write_image
from opencsp_calib.looking import Search
from opencsp_calib.registry import installed
from opencsp_calib.rendering import Exposure, Scene, Spot, render
from opencsp_calib.synthetic import pose_in_view, turned

SPEC = SmallWorld.spec
COACH = Release("coach")
COMMAND = [sys.executable, "-m", "opencsp_calib", "capture"]


@pytest.fixture(scope="module")
def world() -> SmallWorld:
    return SmallWorld.seeded()


def folder_of(path: Path, board: str = SPEC) -> CaptureFolder:
    return CaptureFolder.opened(path, board, "folder", "incoming")


def grey(level: int, side: int = 8) -> Image:
    return Image(f"grey{level}", np.full((side, side), level, dtype=np.uint8), record={"ExposureTime": "5000"})


class Frames:
    """A sequence of rendered frames, each with what it is called."""

    def __init__(self, world: SmallWorld) -> None:
        self.world, self.images, self.names = world, [], []

    def pose(self, tilt_deg: float, azimuth_deg=0.0, roll_deg=0.0, fill=0.6, place=(0.5, 0.5)) -> Pose:
        rotation = turned(*np.radians([tilt_deg, azimuth_deg, roll_deg]))
        return pose_in_view(self.world.board, self.world.camera, rotation, fill, place)

    def add(self, name: str, pose: Pose, count: int = 1, scene=None, exposure=None) -> None:
        for _ in range(count):
            index = len(self.images)
            image = render(
                self.world.camera, self.world.board, pose, scene=scene, exposure=exposure, rng=index, samples=2
            )
            self.images.append(replace(image, name=f"{index:03d} {name}"))
            self.names.append(name)

    def move(self, name: str, start: Pose, end: Pose, count: int) -> None:
        """From one pose to another, at constant speed."""
        for part in np.linspace(0.0, 1.0, count):
            turn = (1 - part) * start.rotation + part * end.rotation
            self.add(name, Pose(turn, (1 - part) * start.translation + part * end.translation))


def released(frames: Frames, path: Path, release=COACH, *, waiting: bool = True) -> list[str]:
    """Names of the frames that became photographs, the coach being given the time to learn after each, or not."""
    search = Search(frames.world.board, installed().detector("checkerboard"), "model")
    capture = Capture(folder_of(path), search, release, 50)
    taken: list[str] = []

    def show(state) -> None:
        if state.new:
            taken.append(state.moment.glance.image.name.split(" ", 1)[1])
            while waiting and capture.behind:
                time.sleep(0.01)

    capture.run(iter(frames.images), show)
    return taken


def test_it_releases_at_the_right_moments_and_only_there(world, tmp_path):
    """A board that comes nearer, is tilted, held still, and then in every way in which it must not be photographed."""
    frames = Frames(world)
    far, head_on, tilted = frames.pose(3, fill=0.4), frames.pose(3, fill=0.7), frames.pose(38, 90, fill=0.7)
    other = frames.pose(38, 180, 90, fill=0.7, place=(0.0, 0.0))
    glare = Scene(glare=(Spot(320.0, 240.0, 40.0, 200.0),))
    frames.move("approaching", far, head_on, 4)
    frames.add("still, but head-on", head_on, 3)
    frames.move("tilting", head_on, tilted, 5)
    frames.add("first right moment", tilted, 5)
    frames.move("moving on", tilted, other, 6)
    frames.add("out of focus", other, 3, exposure=Exposure(defocus_px=8.0))
    frames.add("glare", other, 3, scene=glare)
    frames.add("clipped", other, 3, exposure=Exposure(gain=1.8))
    frames.add("second right moment", other, 4)
    frames.move("moving back", other, tilted, 6)
    frames.add("the first again", tilted, 4)
    cut = Pose(tilted.rotation, tilted.translation + np.array([0.5 * tilted.translation[2], 0.0, 0.0]))
    frames.move("leaving", tilted, cut, 4)
    frames.add("partly out of view", cut, 4)
    right = ["first right moment", "second right moment"]
    assert released(frames, tmp_path / "waiting") == right
    assert released(frames, tmp_path / "at once", waiting=False) == right


def test_an_interval_releases_whatever_the_coach_thinks(world, tmp_path):
    frames = Frames(world)
    frames.add("head-on", frames.pose(0), 3)
    assert released(frames, tmp_path / "every", Release("interval", 0.0)) == ["head-on"] * 3
    assert released(frames, tmp_path / "first", Release("interval", 1000.0)) == ["head-on"]


def test_interval_and_hand_in_seconds():
    interval = release_from("interval:1.5")
    assert not interval.due(right=True, pressed=False, since_s=1.4)
    assert interval.due(right=False, pressed=False, since_s=1.5)
    assert release_from("manual").due(right=False, pressed=True, since_s=0)
    assert not release_from("manual").due(right=True, pressed=False, since_s=1e9)
    assert release_from("coach").due(right=True, pressed=False, since_s=0)
    for wrong in ("interval", "interval:", "interval:-1", "interval:nan", "coach:3", "often", ""):
        with pytest.raises(InputError, match="--release takes coach, manual or interval:SECONDS"):
            release_from(wrong)


def test_photographs_are_lossless_numbered_and_recorded(tmp_path):
    folder = folder_of(tmp_path / "set")
    deep = Image("deep", np.arange(60000, 60064, dtype=np.uint16).reshape(8, 8), sha256="ab")
    paths = [folder.add(image) for image in (grey(1), deep)]
    assert [path.name for path in paths] == ["0001.png", "0002.png"]
    np.testing.assert_array_equal(read_image(ImageFile("", paths[1])).pixels, deep.pixels)
    record = json.loads(paths[0].with_suffix(".json").read_text())
    assert record["settings"] == {"ExposureTime": "5000"}
    assert (record["board"], record["source"], record["device"]) == (SPEC, "folder", "incoming")
    assert folder.sources == {"ab"}


def test_the_last_can_be_deleted_and_numbers_go_on(tmp_path):
    folder = folder_of(tmp_path)
    for level in range(3):
        folder.add(grey(level))
    assert folder.remove_last().name == "0003.png"
    (tmp_path / "0001.png").unlink()
    assert folder.add(grey(9)).name == "0003.png"
    assert [path.name for path in folder.images] == ["0002.png", "0003.png"]
    assert sorted(p.name for p in tmp_path.glob("*.json")) == ["0001.json", "0002.json", "0003.json", "capture.json"]


def test_what_a_killed_capture_left_is_cleared_and_another_board_refused(tmp_path):
    folder_of(tmp_path).add(grey(1))
    (tmp_path / ".writing-x.png").write_bytes(b"half")
    (tmp_path / "0001.json").write_text("{half")
    again = folder_of(tmp_path)
    assert not (tmp_path / ".writing-x.png").exists()
    assert len(again.images) == 1
    with pytest.raises(InputError, match="has photographs of another board, checkerboard:9x6:30mm"):
        folder_of(tmp_path, "checkerboard:8x6:30mm")


def test_an_image_of_another_size_stops_it(world, tmp_path):
    search = Search(world.board, installed().detector("checkerboard"), "model")
    capture = Capture(folder_of(tmp_path), search, Release("interval", 0.0), 5)
    with pytest.raises(InputError, match="16x16 but those before were 64x64"):
        capture.run(iter([grey(1, 64), grey(2, 16)]), lambda state: None)
    assert len(capture.folder.images) == 1


@pytest.fixture(scope="module")
def incoming(tmp_path_factory, world) -> Path:
    folder = tmp_path_factory.mktemp("incoming")
    SmallWorld(world.camera, world.board, world.poses[:8]).photograph(folder)
    return folder


def capture(folder: Path, incoming: Path, *more: str) -> int:
    options = ["--source", "folder", "--device", str(incoming), "--set", "wait=0", *more]
    return run(["capture", str(folder), "--board", SPEC, *options])


def test_a_folder_becomes_a_set_and_the_next_command_is_said(incoming, tmp_path, capsys):
    assert capture(tmp_path / "my set", incoming, "--release", "interval:0", "--count", "7") == 0
    said = capsys.readouterr().err
    assert "7 of 7 photographs" in said
    assert f"opencsp-calib calibrate '{tmp_path / 'my set'}' --board {SPEC} -o 'my set.h5'" in said
    assert "second, independent set" in said
    command = next(line for line in said.splitlines() if "opencsp-calib calibrate" in line)
    assert run(["calibrate", str(tmp_path / "my set"), "--board", SPEC, "-o", str(tmp_path / "c.h5")]) == 0
    assert command.split()[1] == "calibrate"


def test_it_goes_on_where_it_stopped_and_takes_no_file_twice(incoming, tmp_path, capsys):
    for count, taken in ((3, 3), (50, 8), (50, 8)):
        assert capture(tmp_path, incoming, "--release", "interval:0", "--count", str(count)) == 0
        assert len(list(tmp_path.glob("*.png"))) == taken
    assert "has 8 photographs already: going on after them" in capsys.readouterr().err


def test_a_full_disk_stops_it_with_nothing_lost(incoming, tmp_path, capsys):
    if os.name != "posix" or os.geteuid() != 0:
        pytest.skip("only root can mount a small file system")
    disk = tmp_path / "disk"
    disk.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=700k", "tmpfs", disk], capture_output=True).returncode:
        pytest.skip("no file system can be mounted here")
    try:
        assert capture(disk / "set", incoming, "--release", "interval:0") == 2
        said = capsys.readouterr().err
        names = sorted(path.name for path in (disk / "set").iterdir())
        images = [name for name in names if name.endswith(".png")]
        assert 1 <= len(images) < 8
        for name in images:
            read_image(ImageFile(name, disk / "set" / name))
        assert not [name for name in names if name.startswith(".")]
        assert "No space left on device" in said
        assert f"the {len(images)} photographs taken are safe" in said
        subprocess.run(["mount", "-o", "remount,size=20m", disk], check=True)
        assert capture(disk / "set", incoming, "--release", "interval:0", "--count", "8") == 0
        assert len(list((disk / "set").glob("*.png"))) == 8
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
        wait_for(process, "0003.png: 3 of 50")
        process.send_signal(signal.SIGKILL)
    images = sorted((tmp_path / "set").glob("[0-9]*.png"))
    assert len(images) >= 3
    for path in images:
        read_image(ImageFile(path.name, path))
    assert capture(tmp_path / "set", incoming, "--release", "interval:0", "--count", "8") == 0
    assert len(list((tmp_path / "set").glob("*.png"))) == 8


def test_keys_release_delete_and_stop(world, tmp_path):
    """Written to its standard input, as a person's program does; on a terminal they need no Enter."""
    incoming = tmp_path / "incoming"
    incoming.mkdir()
    source = render(world.camera, world.board, world.poses[0], samples=2)

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
