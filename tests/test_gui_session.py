"""The window's session on the disk: tomorrow goes on from it, whatever has become of it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

pytest.importorskip("nicegui")

from opencsp_calib.gui.session import Session
from opencsp_calib.gui.session_file import write_session
from opencsp_calib.gui.settings import Settings


def kept(folder: Path) -> Path:
    """A session with a camera's name, written."""
    session = Session(folder)
    session.settings = replace(session.settings, camera_name="west")
    session.own.mkdir(exist_ok=True)
    write_session(session)
    return session.own / "session.json"


def test_tomorrow_goes_on_from_it(tmp_path: Path) -> None:
    kept(tmp_path)
    again = Session(tmp_path)
    assert again.settings.camera_name == "west"
    assert again.message.text == "Going on from where you left."


@pytest.mark.parametrize("damage", ["", "[]", "{", '{"version": 1}', "of another version"])
def test_what_cannot_be_read_is_said_and_kept(tmp_path: Path, damage: str) -> None:
    path = kept(tmp_path)
    if damage == "of another version":
        damage = json.dumps(json.loads(path.read_text()) | {"version": 99})
    path.write_text(damage)
    again = Session(tmp_path)
    assert "session.json cannot be read" in again.message.text
    assert again.message.level == "bad"
    assert again.settings == Settings()
    write_session(again)
    assert path.with_name("session-not-read.json").read_text() == damage


def test_a_result_that_is_damaged_takes_nothing_else_along(tmp_path: Path) -> None:
    path = kept(tmp_path)
    (path.parent / "calibration.hdf5").write_bytes(b"damaged")
    again = Session(tmp_path)
    assert again.settings.camera_name == "west"
    assert "calibration.hdf5" in again.message.text
    assert (again.message.level, again.calibration) == ("bad", None)
    assert path.exists()
