"""Strangers' bytes to plain values, and plain values to numbers by name: what all readers stand on."""

import ast
import contextlib
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from effort import at_most
from hypothesis import given, settings
from hypothesis import strategies as st
from opencsp_calib_formats.fields import Fields, matrix, number, numbers, whole
from opencsp_calib_formats.python_literal import parse_literal
from opencsp_calib_formats.reading import decimal
from opencsp_calib_formats.safe_text import (
    Repeated,
    head,
    parse_json,
    parse_toml,
    parse_xml,
    read_bytes,
    read_text,
)
from opencsp_calib_formats.safe_yaml import parse_yaml

from opencsp_calib.errors import FileFormatError

OPENINGS = ["[", "{", "- ", '{"a":', "a = ", '"', "'", "'''", "1", "/*", "//", "\\", "#", "a.", "!a ", "? ", "\t"]
NO_LITERALS = ["[1,,2]", "{'a'}", "{'a' 1}", "[1 2]", "[(])", "'a", "1 2", "", "{:1}", "[1][0]", "f(1)", ")"]
NO_NUMBERS = [True, None, "", "x", "1_0", "nan", "inf", ".Nan", "1,5", "0x10", "1e999", math.nan, math.inf, [1], {}]
NO_NUMBERS += [10**400]


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "latin-1"])
def test_encodings(encoding: str, tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes("caméra: 1\r\nb: 2\r".encode(encoding))
    assert read_text(path) == "caméra: 1\nb: 2\n"
    assert head(path).startswith("caméra")


def test_what_is_no_text(tmp_path: Path) -> None:
    path = tmp_path / "a"
    for content, message in ((b"", "empty"), (b"a\0b", "binary"), (b"x" * 2000, "more than 0 MiB")):
        path.write_bytes(content)
        with pytest.raises(FileFormatError, match=message):
            read_text(path, 1000)
    path.write_bytes(b"a\0b")
    assert head(path) == head(tmp_path) == head(tmp_path / "none") == head(tmp_path / "a\0b") == ""
    for missing in (tmp_path, tmp_path / "none", Path("a\0b")):
        with pytest.raises(FileFormatError):
            read_bytes(missing)
    path.write_bytes("é".encode() * 10)
    assert head(path, 5) == "éé"  # and half of one


def test_yaml_scalars_are_their_text() -> None:
    text = "a: [1e-05, 0123, yes, 12:30:00, .nan, 2026-01-01]\nb: !!python/object/apply:os.system [x]\nc: ~\nd: 'q'\n"
    assert parse_yaml(text) == [
        {"a": ["1e-05", "0123", "yes", "12:30:00", ".nan", "2026-01-01"], "b": ["x"], "c": "~", "d": "q"}
    ]


plain_yaml = st.recursive(
    st.text(st.characters(codec="ascii", min_codepoint=32), min_size=1, max_size=8),
    lambda inside: st.lists(inside, max_size=4) | st.dictionaries(st.text("abcde", min_size=1, max_size=4), inside),
    max_leaves=20,
)


@settings(max_examples=100)
@given(plain_yaml)
def test_yaml_as_pyyaml_writes_it(value: Any) -> None:
    assert parse_yaml(yaml.safe_dump(value)) == [value]


def test_aliases_within_bounds() -> None:
    assert parse_yaml("a: &x [1, 2]\nb: [*x, *x]") == [{"a": ["1", "2"], "b": [["1", "2"], ["1", "2"]]}]
    laughs = "a: &a [lol, lol]\n" + "".join(
        f"{y}: &{y} [{', '.join([f'*{x}'] * 9)}]\n" for x, y in zip("abcdefgh", "bcdefghi", strict=True)
    )
    for text in (laughs, "a: &a [*a]", "a: *none", "a: &x 1\nb: [" + "*x, " * 2000 + "]"):
        with pytest.raises(FileFormatError, match="aliases"):
            parse_yaml(text)


@pytest.mark.parametrize("parse", [parse_yaml, parse_json, parse_toml, parse_literal])
@pytest.mark.parametrize("opening", OPENINGS)
def test_nothing_takes_long(parse: Any, opening: str) -> None:
    with at_most(5), contextlib.suppress(FileFormatError):
        parse(("a = " if parse is parse_toml else "") + opening * 200_000)


def test_a_key_that_is_there_twice_is_an_error_when_asked_for() -> None:
    for values in (parse_json('{"a": 1, "a": 2, "b": 3}'), parse_yaml("a: 1\na: 2\nb: 3")[0]):
        fields = Fields(values)
        assert fields.number("b") == 3
        assert isinstance(fields.raw("a"), Repeated)
        for ask in (fields.number, fields.numbers, fields.fields, fields.text, fields.whole):
            with pytest.raises(FileFormatError, match=r"^a"):
                ask("a")
    assert parse_json('{"a": 1, "a": 1}') == {"a": 1}


def test_json_as_opencv_writes_it() -> None:
    found = parse_json('{"a": 0., // one\n "b": [.Nan, -.Inf, 1.5, "http://x.", -3., 2.e3]}')
    assert found["a"] == 0.0
    assert math.isnan(found["b"][0])
    assert found["b"][1:] == [-math.inf, 1.5, "http://x.", -3.0, 2000.0]


def test_xml_without_entities() -> None:
    assert parse_xml(b"<?xml version='1.0' encoding='latin-1'?><a>\xe9</a>").text == "é"
    bomb = b'<!DOCTYPE a [<!ENTITY b "lol"><!ENTITY c "&b;&b;">]><a>&c;</a>'
    outside = b'<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/passwd">]><a>&b;</a>'
    for data in (bomb, outside, b"<a>", b"", b"<a>" * 200 + b"</a>" * 200, b"<?xml version='1.0' encoding='x'?><a/>"):
        with pytest.raises(FileFormatError):
            parse_xml(data)


literals = st.recursive(
    st.text(st.characters(codec="ascii", exclude_characters="\\'\"", min_codepoint=32, max_codepoint=126), max_size=6),
    lambda inside: st.lists(inside, max_size=4) | st.dictionaries(st.text("abc'", max_size=3), inside, max_size=4),
    max_leaves=15,
)


@settings(max_examples=100)
@given(literals)
def test_literals_as_python_reads_them(value: Any) -> None:
    assert parse_literal(repr(value)) == ast.literal_eval(repr(value))


@pytest.mark.parametrize("text", NO_LITERALS)
def test_literals_that_are_none(text: str) -> None:
    with pytest.raises(FileFormatError):
        parse_literal(text)


@pytest.mark.parametrize(
    ("value", "expected"),
    [(3, 3.0), ("1e-05", 1e-5), ("-2E3", -2000.0), ("5.", 5.0), (".5", 0.5), (" 7 ", 7.0), ("+1d-2", 0.01)],
)
def test_numbers_and_their_text(value: Any, expected: float) -> None:
    assert number(value, "x") == expected


@pytest.mark.parametrize("value", NO_NUMBERS)
def test_what_is_no_number(value: Any) -> None:
    with pytest.raises(FileFormatError, match=r"^x is "):
        number(value, "x")


def test_lists_and_matrices_of_numbers() -> None:
    assert numbers([[1, "2"], [3]], "x").tolist() == [1, 2, 3]
    assert numbers("1 2, 3", "x", 3).tolist() == [1, 2, 3]
    nested, flat = [[1, 2], [3, 4], [5, 6]], {"rows": "3", "cols": "2", "data": [1, 2, 3, 4, 5, 6]}
    assert np.array_equal(matrix(nested, "x", 3, 2), matrix(flat, "x", 3, 2))
    for wrong, message in (
        (flat, "x is 3x2, expected 2x3"),
        (nested, "3 rows, expected 2"),
        ({**flat, "rows": 4}, "said to be 4x2, but has 6 numbers"),
        ([1, 2], "x has 2 numbers, expected 6"),
        (5, "not a list of numbers"),
    ):
        with pytest.raises(FileFormatError, match=message):
            matrix(wrong, "x", 2, 3)
    with pytest.raises(FileFormatError, match="not a whole number"):
        whole("1.5", "x")


def test_fields_say_where() -> None:
    fields = Fields({"cam0": {"a": [1, 2], "flag": "Yes", "null": None, "list": [{"b": 1}]}}).fields("cam0")
    assert fields.flag("flag")
    assert not fields.flag("none")
    assert fields.number("null", 5.0) == 5.0
    assert fields.first("null", "a") == "a"
    for ask, message in (
        (lambda: fields.number("c"), r"^cam0.c is missing"),
        (lambda: fields.numbers("a", 3, 4), r"^cam0.a has 2 numbers, expected 3 or 4"),
        (lambda: fields.flag("a"), r"^cam0.a is neither"),
        (lambda: fields.each("list")[0].number("x"), r"^cam0.list\[0\].x is missing"),
        (lambda: fields.each("a"), r"^cam0.a\[0\] holds no named values"),
        (lambda: fields.text("a"), r"^cam0.a is not text"),
    ):
        with pytest.raises(FileFormatError, match=message):
            ask()


@settings(max_examples=200)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_written_numbers_are_numbers_to_every_reader(value: float) -> None:
    assert float(decimal(value)) == value
    loaded = yaml.safe_load(f"a: {decimal(value)}")["a"]
    assert isinstance(loaded, float)
    assert loaded == value
