"""What the command line writes for people, whatever it is about."""

import os

import pytest

from opencsp_calib.cli import run


@pytest.mark.skipif(os.name != "posix", reason="no such names there")
def test_a_terminal_obeys_no_file_name(tmp_path, capsys):
    name = "\x1b]0;title\x07\x9b31mred.png"
    (tmp_path / name).write_bytes(b"no image")
    assert run(["calibrate", str(tmp_path), "--board", "checkerboard:9x6:30mm"]) == 2
    said = capsys.readouterr().err
    assert r"\x1b]0;title\x07\x9b31mred.png" in said
    assert said.rstrip("\n").isprintable()
