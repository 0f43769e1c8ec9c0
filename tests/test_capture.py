"""A capture: photographs at the right moments and only then, whole on the disk whatever happens."""

import json
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import SmallWorld

from opencsp_calib import Board, InputError, Pose
from opencsp_calib.capture import Capture, CaptureFolder, Release, State, release_from
from opencsp_calib.capture.learner import Learner
from opencsp_calib.capture.learning import Study
from opencsp_calib.errors import CalibError
from opencsp_calib.image import Image
from opencsp_calib.images import ImageFile, read_image, write_image
from opencsp_calib.looking import Search
from opencsp_calib.registry import installed
from opencsp_calib.rendering import Exposure, Scene, Spot, render
from opencsp_calib.synthetic import pose_in_view, turned

SPEC = SmallWorld.spec
COACH = Release("coach")


def folder_of(path: Path, board: str = SPEC) -> CaptureFolder:
    return CaptureFolder.opened(path, board, "folder", "incoming")


def search_for(board: Board) -> Search:
    return Search(board, installed().detector("checkerboard"), "model")


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
    capture = Capture(folder_of(path), search_for(frames.world.board), release, 50)
    taken: list[str] = []

    def show(state: State) -> None:
        if state.new:
            taken.append(state.moment.glance.image.name.split(" ", 1)[1])
            while waiting and capture.behind:
                time.sleep(0.01)

    capture.run(iter(frames.images), show)
    return taken


def test_it_releases_at_the_right_moments_and_only_there(small_world, tmp_path):
    """A board that comes nearer, is tilted, held still, and then in every way in which it must not be photographed."""
    frames = Frames(small_world)
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


def test_an_interval_releases_whatever_the_coach_thinks(small_world, tmp_path):
    frames = Frames(small_world)
    frames.add("head-on", frames.pose(0), 3)
    for name, seconds, count in (("every", 0.0, 3), ("first", 1000.0, 1)):
        assert released(frames, tmp_path / name, Release("interval", seconds), waiting=False) == ["head-on"] * count


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


def test_deleting_the_last_leaves_alone_what_is_not_of_the_capture(tmp_path):
    (tmp_path / "z.png").write_bytes(b"somebody's")
    folder = folder_of(tmp_path)
    folder.add(grey(1))
    assert folder.remove_last().name == "0001.png"
    assert folder.remove_last() is None
    assert (tmp_path / "z.png").exists()


def test_what_a_killed_capture_left_is_cleared_and_another_board_refused(tmp_path):
    folder_of(tmp_path).add(grey(1))
    (tmp_path / ".writing-x.png").write_bytes(b"half")
    (tmp_path / "0001.json").write_text("{half")
    again = folder_of(tmp_path)
    assert not (tmp_path / ".writing-x.png").exists()
    assert len(again.images) == 1
    with pytest.raises(InputError, match="has photographs of another board, checkerboard:9x6:30mm"):
        folder_of(tmp_path, "checkerboard:8x6:30mm")


def test_a_photograph_that_took_the_place_of_another_is_learnt_from(small_world, photographs, tmp_path):
    """Two are deleted, and the next gets the first one's name, while the coach still learns from the second."""
    first, second = tmp_path / "0001.png", tmp_path / "0002.png"
    learner = Learner(Study(search_for(small_world.board), small_world.camera.image_size, None, 0.1))
    try:
        for place in (first, second):
            write_image(np.full((480, 640), 90, np.uint8), place)
        learner.know([first])
        assert not learner.wait().views  # where the board is seen
        learner.know([first, second])
        learner.know([])
        first.write_bytes((photographs / "01.png").read_bytes())
        learner.know([first])
        assert len(learner.wait().views) == 1
    finally:
        learner.close()


@pytest.mark.parametrize("rest", [0, 20])
def test_the_coach_that_dies_is_one_sentence(rest, small_world, tmp_path, monkeypatch):
    """Before its answer, or in the middle of it."""
    answer = f"sys.stdout.buffer.write(pickle.dumps(list(range(99)))[:{rest}])"
    program = [sys.executable, "-c", f"import pickle, sys; pickle.load(sys.stdin.buffer); {answer}"]
    monkeypatch.setattr("opencsp_calib.capture.learner.own_process", lambda *_, **__: program)
    learner = Learner(Study(search_for(small_world.board), (64, 64), None, 0.1))
    try:
        learner.know([tmp_path / "0001.png"])
        with pytest.raises(CalibError, match="the coach's process ended unexpectedly"):
            learner.wait()
    finally:
        learner.close()


def test_an_image_of_another_size_stops_it(small_world, tmp_path):
    capture = Capture(folder_of(tmp_path), search_for(small_world.board), Release("interval", 0.0), 5)
    with pytest.raises(InputError, match="16x16 but those before were 64x64"):
        capture.run(iter([grey(1, 64), grey(2, 16)]), lambda state: None)
    assert len(capture.folder.images) == 1


def test_a_photograph_is_deleted_also_where_no_frame_comes_after_it(small_world, tmp_path):
    capture = Capture(folder_of(tmp_path), search_for(small_world.board), Release("interval", 0.0), 5)
    taken = []

    def show(state: State) -> None:
        taken.append(state.new)
        capture.delete_last()

    capture.run(iter([grey(1, 64)]), show)
    assert taken == ["0001.png"]
    assert capture.folder.images == ()
