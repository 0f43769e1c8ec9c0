"""Interrupted runs go on from what is done: killed at any moment, with torn, damaged and foreign records."""

import os
import signal
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from observed import assert_same
from worlds import SmallWorld

from opencsp_calib import Checkerboard, InputError, Observations, detect
from opencsp_calib.cli import run
from opencsp_calib.hdf5_calibration import load_observations
from opencsp_calib.images import find_images, read_image, write_image
from opencsp_calib.journal import Journal, journal_beside
from opencsp_calib.looking import Search
from opencsp_calib.registry import installed


def images_in(journal: Path) -> list[str]:
    """The SHA-256 of every image that a journal has a whole line of."""
    lines = journal.read_bytes().split(b"\n")
    return [line.split(b" ")[3].decode() for line in lines if line.count(b" ") > 3 and line.endswith(b"}")]


@pytest.fixture(scope="module")
def looked_at(
    small_world: SmallWorld, photographs: Path, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Observations, bytes]:
    """What is seen without a journal; and the journal of a whole run, with an image in it that shows no board."""
    folder = tmp_path_factory.mktemp("journal")
    seen = detect(photographs, small_world.board)
    journal = Journal(folder / "run.journal")
    assert_same(detect(photographs, small_world.board, journal=journal), seen)
    return seen, journal.path.read_bytes()


def test_a_second_run_takes_everything_from_the_journal(
    small_world: SmallWorld, photographs: Path, looked_at: tuple[Observations, bytes], tmp_path: Path
) -> None:
    seen, content = looked_at
    path = tmp_path / "j"
    path.write_bytes(content)
    journal = Journal(path)
    assert_same(detect(photographs, small_world.board, journal=journal), seen)
    assert journal.taken == 12
    assert path.read_bytes() == content


def test_other_names_are_the_same_images(small_world: SmallWorld, photographs: Path, looked_at, tmp_path: Path) -> None:
    path = tmp_path / "j"
    path.write_bytes(looked_at[1])
    (tmp_path / "odd\nname é.png").write_bytes((photographs / "03.png").read_bytes())
    journal = Journal(path)
    found = detect(tmp_path / "odd\nname é.png", small_world.board, journal=journal)
    assert journal.taken == 1
    assert found.views[0].image == "odd\nname é.png"
    np.testing.assert_array_equal(found.detections[0].pixels, looked_at[0].detections[2].pixels)


def test_other_settings_take_nothing(photographs: Path, looked_at: tuple[Observations, bytes], tmp_path: Path) -> None:
    path = tmp_path / "j"
    path.write_bytes(looked_at[1])
    files = sorted(photographs.glob("*.png"))[:2]
    for board, refine in ((Checkerboard(9, 6, 0.031), None), (Checkerboard(9, 6, 0.03), "none")):
        journal = Journal(path)
        detect(files, board, refine=refine, journal=journal)
        assert (journal.taken, journal.foreign >= 12) == (0, True)


@settings(max_examples=25)
@given(st.data())
def test_damage_costs_work_and_never_a_wrong_result(
    small_world: SmallWorld, photographs: Path, looked_at, tmp_path_factory: pytest.TempPathFactory, data: st.DataObject
) -> None:
    """Cut anywhere, or with any bytes changed: what is taken is what was found, and the rest is looked at again."""
    seen, content = looked_at
    path = tmp_path_factory.mktemp("damaged") / "j"
    start = len(b"opencsp-calib journal 1\n")
    damaged = bytearray(content[: data.draw(st.integers(start, len(content)))])
    for place in data.draw(st.lists(st.integers(start, max(start, len(damaged) - 1)), max_size=3)):
        if place < len(damaged):
            damaged[place] = data.draw(st.integers(0, 255))
    path.write_bytes(damaged)
    detector = installed().detector("checkerboard")
    board = small_world.board
    journal = Journal(path)
    with journal.open(Search(board, detector, "model").key):
        for view in seen.views:
            look = journal.find(view.sha256, view.image)
            if look is not None:
                assert_same(Observations(board, look.size, (look.view,)), Observations(board, look.size, (view,)))


def test_a_torn_line_does_not_hurt_the_next(small_world: SmallWorld, photographs: Path, looked_at, tmp_path) -> None:
    path = tmp_path / "j"
    path.write_bytes(looked_at[1][:-1000])
    for taken in (11, 12):
        journal = Journal(path)
        assert_same(detect(photographs, small_world.board, journal=journal), looked_at[0])
        assert journal.taken == taken


@pytest.mark.filterwarnings("default")
def test_somebody_elses_file_is_left_alone(
    small_world: SmallWorld, photographs: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "seen.h5.journal"
    path.write_text("dear diary")
    with pytest.raises(InputError, match="move it away"):
        detect(photographs, small_world.board, journal=Journal(path))
    files = [str(file.path) for file in find_images(photographs)[:1]]
    assert run(["detect", *files, "--board", SmallWorld.spec, "-o", str(tmp_path / "seen.h5")]) == 0
    assert "move it away" in capsys.readouterr().err
    assert path.read_text() == "dear diary"


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no /dev/full here to stand for a full disk")
def test_a_full_disk_costs_the_journal_not_the_run(small_world: SmallWorld, photographs: Path, looked_at) -> None:
    with pytest.warns(RuntimeWarning, match=r"can no longer be kept|cannot be kept"):
        found = detect(photographs, small_world.board, journal=Journal("/dev/full", resume=False))
    assert_same(found, looked_at[0])


def test_resuming_needs_an_output(photographs: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["calibrate", str(photographs), "--board", SmallWorld.spec, "--resume"]) == 2
    assert "-o" in capsys.readouterr().err


def test_killed_and_resumed(small_world: SmallWorld, photographs: Path, looked_at, tmp_path: Path) -> None:
    """The whole program, killed without warning twice: the same file in the end, and no image done twice."""
    folder = tmp_path / "images"
    folder.mkdir()
    for index in range(24):  # the same twelve photographs, two of each, with another pixel in a corner
        pixels = read_image(find_images(photographs)[index % 12]).pixels.copy()
        pixels[0, 0] = index
        write_image(pixels, folder / f"{index:02d}.png")
    output = tmp_path / "seen.h5"
    journal = journal_beside(output)
    command = [sys.executable, "-m", "opencsp_calib", "detect", str(folder), "--board", SmallWorld.spec, "--jobs", "1"]
    done: list[int] = []
    for _ in range(2):
        process = subprocess.Popen([*command, "-o", str(output), "--resume"], stderr=subprocess.DEVNULL)
        wanted = (done[-1] if done else 0) + 3
        while process.poll() is None and not (journal.exists() and len(images_in(journal)) >= wanted):
            time.sleep(0.01)
        if process.poll() is None:
            os.kill(process.pid, getattr(signal, "SIGKILL", signal.SIGTERM))
        process.wait()
        if not journal.exists():
            break
        done.append(len(images_in(journal)))
        assert max(Counter(images_in(journal)).values()) == 1
        assert not output.exists()
    assert done
    assert done == sorted(done)
    subprocess.run([*command, "-o", str(output), "--resume"], check=True, stderr=subprocess.DEVNULL)
    assert not journal.exists()
    assert_same(load_observations(output), detect(folder, small_world.board))
