"""A file is there whole or not at all, whatever happens while it is written."""

import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from opencsp_calib.atomic import replacing

STOPPED_WHILE_SAVING = """
import signal, sys
import h5py
from opencsp_calib.cli import run

signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell that started the tests aside has them ignore it
written = h5py.Group.create_dataset

def stopped(self, name, *args, **options):
    h5py.Group.create_dataset = written  # asked once: a second time is for those who do not want to wait for us
    signal.raise_signal(signal.SIGINT)  # as Ctrl-C does: Python's handler runs in the main thread, which waits for this
    return written(self, name, *args, **options)

h5py.Group.create_dataset = stopped
sys.exit(run(["convert", "--params", "fx=2700,fy=2700,cx=830,cy=630", "--model", "pinhole", "--image-size", "1626x1236",
              sys.argv[1]]))
"""


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_what_stood_there_stays_when_writing_is_stopped(error: type[BaseException], tmp_path: Path) -> None:
    path = tmp_path / "camera.h5"
    path.write_text("before")

    def write_half() -> None:
        with replacing(path) as temporary:
            temporary.write_text("aft")
            raise error

    with pytest.raises(error):
        write_half()
    assert [p.read_text() for p in tmp_path.iterdir()] == ["before"]


@pytest.mark.skipif(os.name != "posix", reason="has no such permissions")
def test_permissions_are_those_of_any_new_file_or_of_the_one_before(tmp_path: Path, monkeypatch) -> None:
    """The umask is the whole process's: changed even for a moment, it is so for files that other threads make."""

    def written(name: str) -> list[int]:
        path = tmp_path / name
        with replacing(path) as temporary:
            meanwhile = stat.S_IMODE(temporary.stat().st_mode)
        return [meanwhile, stat.S_IMODE(path.stat().st_mode)]

    (tmp_path / "private").touch(0o600)
    (tmp_path / "shared").touch()
    (tmp_path / "shared").chmod(0o664)
    before = os.umask(0o027)
    try:
        monkeypatch.setattr(os, "umask", None)
        found = [written(name) for name in ("new", "private", "shared")]
        monkeypatch.undo()
    finally:
        os.umask(before)
    assert found == [[0o640, 0o640], [0o600, 0o600], [0o600, 0o664]]


def test_control_c_in_the_middle_of_saving_leaves_nothing_and_says_so(tmp_path: Path) -> None:
    done = subprocess.run(
        [sys.executable, "-c", STOPPED_WHILE_SAVING, str(tmp_path / "camera.h5")], capture_output=True, text=True
    )
    assert (done.returncode, done.stderr.strip()) == (1, "error: stopped; what was not finished was not written")
    assert list(tmp_path.iterdir()) == []
