"""Commands run in this process: what they answer, and how they complain."""

import json

import pytest
from json_page import assert_as_documented

from opencsp_calib.cli import run

QUICK = ("--solver", "opencv")


def answer(capsys: pytest.CaptureFixture[str], *arguments: object, code: int = 0) -> dict:
    """The JSON that a command prints, which must be as documented; standard output must hold nothing else."""
    ended = run([*map(str, arguments), "--json"])
    output = capsys.readouterr()
    assert ended == code, output.err
    assert "Traceback" not in output.err
    printed = json.loads(output.out)
    assert_as_documented(str(arguments[0]), printed)
    return printed


def complaint(capsys: pytest.CaptureFixture[str], *arguments: object, code: int = 2) -> str:
    """What a command that fails says: one line at the end, no traceback, nothing on standard output."""
    assert run([*map(str, arguments)]) == code
    output = capsys.readouterr()
    assert output.out == ""
    assert "Traceback" not in output.err
    last = output.err.strip().splitlines()[-1]
    assert last.startswith("error: ")
    return last
