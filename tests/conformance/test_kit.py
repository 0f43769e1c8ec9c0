"""What every plugin promises, and the kit itself."""

from pathlib import Path

import pytest
from lies import Source, caught

from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.conformance import checks_of, parametrize_checks
from opencsp_calib.errors import InputError


class Empty(Source):
    def images(self):
        return iter(())


class WithASpace(Source):
    name = "My Source"


class MissingALot(Source):
    def missing(self):
        return "this\nand that"


def test_names_and_what_is_missing():
    assert caught(WithASpace(), "has_a_name_that_can_be_typed")
    assert caught(MissingALot(), "says_what_is_missing")


def test_a_plugin_that_imports_its_vendor_is_caught(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    package = tmp_path / "greedy"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "vendor.py").write_text("try:\n    import cv2\nexcept ImportError:\n    pass\n")
    (package / "lazy.py").write_text(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import cv2\ndef f():\n    import cv2\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    liar = type("Greedy", (Source,), {"__module__": "greedy.solver"})()
    (package / "solver.py").write_text("from . import vendor\n")
    assert "cv2" in caught(liar, "loads_no_vendor_when_listed")
    honest = type("Lazy", (Source,), {"__module__": "greedy.lazy"})()
    {c.name: c for c in checks_of(honest)}["loads_no_vendor_when_listed"](honest)


def test_what_is_missing_something_is_skipped_and_only_where_it_must_run():
    class Absent(Source):
        def missing(self):
            return "pip install it"

    parameters = parametrize_checks(Absent()).mark.args[1]
    skipped = {p.values[1].name for p in parameters if any(mark.name == "skip" for mark in p.marks)}
    assert skipped == {
        "lists_its_devices",
        "refuses_an_unknown_device",
        "delivers_images",
        "can_be_left_and_opened_again",
    }


def test_a_known_failure_is_strict_and_must_name_a_check():
    parameters = parametrize_checks(Empty(), device="one", known_failures={"delivers_images": "it is empty"}).mark.args[
        1
    ]
    marked = {p.values[1].name: p.marks for p in parameters if p.marks}
    assert list(marked) == ["delivers_images"]
    (mark,) = marked["delivers_images"]
    assert (mark.name, mark.kwargs) == ("xfail", {"reason": "it is empty", "strict": True})
    with pytest.raises(InputError, match="no check is called delivers_image;"):
        parametrize_checks(Empty(), known_failures={"delivers_image": "a slip of the pen"})


def test_what_fulfils_no_contract_is_refused():
    with pytest.raises(InputError, match="Solver"):
        checks_of(object())
    assert isinstance(Checkerboard(3, 4, 0.1), Board)
