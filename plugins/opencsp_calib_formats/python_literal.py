"""Python literals out of a stranger's file, without Python's parser: dictionaries, lists, strings, numbers, comments.

`ast.literal_eval` runs no code, but its documentation warns that nesting crashes it; this needs no recursion. Numbers
stay text, as `safe_yaml` leaves YAML's.
"""

import re
from typing import Any

from opencsp_calib.errors import FileFormatError
from opencsp_calib_formats.safe_text import set_once

__all__ = ["parse_literal"]

MAX_DEPTH = 16
TOKEN = re.compile(
    r"""(?P<space>(?:\\\n|\s|\#[^\n]*)+)
    |(?P<string>[bBrRuU]{0,2}(?:'''(?:.*?)(?:'''|\Z)|\"\"\"(?:.*?)(?:\"\"\"|\Z)
        |'(?:[^'\\\n]|\\.)*(?:'|\Z)|"(?:[^"\\\n]|\\.)*(?:"|\Z)))
    |(?P<mark>[\[\](){},:])
    |(?P<word>[^\s\[\](){},:\#'"]+)""",
    re.VERBOSE | re.DOTALL,
)
CLOSES = {"[": "]", "(": ")", "{": "}"}


def parse_literal(text: str) -> Any:
    """The value of a Python literal: dictionaries, lists (tuples too), strings; numbers and names as text.

    Raises
    ------
    FileFormatError
        If it is none, or nested more than 16 deep.
    """
    reader = _Reader()
    position = 0
    while position < len(text):
        match = TOKEN.match(text, position)
        if match is None:
            line = text.count("\n", 0, position) + 1
            raise FileFormatError(f"not a Python literal, line {line}")
        position = match.end()
        if match["string"] is not None:
            reader.value(_unquoted(match["string"]))
        elif match["word"] is not None:
            reader.value(match["word"])
        elif match["mark"] is not None:
            reader.mark(match["mark"])
    return reader.result()


def _unquoted(token: str) -> str:
    body = token.lstrip("bBrRuU")
    quotes = body[:3] if body[:3] in ("'''", '"""') else body[:1]
    if len(body) < 2 * len(quotes) or not body.endswith(quotes):
        raise FileFormatError("a string is not closed")
    return body[len(quotes) : -len(quotes)]


class _Reader:
    """Builds the value from its tokens. Of each open bracket: how it closes, its items, and the key that waits."""

    def __init__(self) -> None:
        self._open: list[tuple[str, Any, list[str]]] = []
        self._may_follow = True  # whether a value may come now: not right after another one
        self._done: list[Any] = []

    def value(self, value: Any) -> None:
        """Take a finished value."""
        if not self._may_follow:
            raise FileFormatError("two values without a comma between them")
        self._may_follow = False
        if not self._open:
            self._done.append(value)
            return
        closing, items, keys = self._open[-1]
        if closing != "}":
            items.append(value)
        elif keys:
            set_once(items, keys.pop(), value)
        elif isinstance(value, str):
            keys.append(value)
        else:
            raise FileFormatError("a key is no string")

    def mark(self, mark: str) -> None:
        """Take a bracket, comma or colon."""
        if mark in CLOSES:
            if len(self._open) >= MAX_DEPTH or not self._may_follow:
                raise FileFormatError(f"nested more than {MAX_DEPTH} deep, or a bracket after a value")
            self._open.append((CLOSES[mark], {} if mark == "{" else [], []))
            return
        if not self._open:
            raise FileFormatError(f"{mark!r} outside of brackets")
        closing, items, keys = self._open[-1]
        if mark == ":":
            if closing != "}" or not keys or self._may_follow:
                raise FileFormatError("a colon that follows no key")
        elif keys or (mark == "," and self._may_follow) or mark not in (",", closing):
            raise FileFormatError(f"{mark!r} is out of place")
        self._may_follow = True
        if mark == closing:
            self._open.pop()
            self.value(items)

    def result(self) -> Any:
        """The one value there was."""
        if self._open or len(self._done) != 1:
            raise FileFormatError("not one whole Python literal")
        return self._done[0]
