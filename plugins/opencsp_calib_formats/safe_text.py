"""Text files of strangers: bytes to text, and JSON, TOML and XML to plain dictionaries, lists and strings.

Every reader of this plugin goes through here or `safe_yaml`, so that what a hostile file can cost is bounded in one
place: size before reading, depth before anything recurses. Whatever is wrong with a file is a FileFormatError. Numbers
are left to `fields`.
"""

import importlib
import json
import re
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError  # the type and the error; defusedxml does the parsing

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from opencsp_calib.errors import FileFormatError

tomllib: Any = importlib.import_module("tomllib" if sys.version_info >= (3, 11) else "tomli")

__all__ = ["MAX_BYTES", "MAX_DEPTH", "Repeated", "head", "once", "parse_json", "parse_toml", "parse_xml", "read_bytes"]
__all__ += ["read_text", "set_once"]

MAX_BYTES = 32 * 2**20
MAX_DEPTH = 64
MAX_CONTAINERS = 2_000_000  # lists and dictionaries of a JSON or TOML file: each costs a hundred times its two brackets

# It must stay linear in the length of the text: an open string runs to the end, a number matches with or without a
# point, so that neither is tried again from each of its characters.
JSON_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*(?:"|\Z)|//[^\n]*|(-?)\.(Nan|Inf)\b|-?\d+(?:\.(?!\d))?', re.DOTALL)


@dataclass(frozen=True)
class Repeated:
    """Stands for the value of a key that a file has twice: an error for whoever asks for it, harmless otherwise."""


def read_bytes(path: Path, limit: int = MAX_BYTES) -> bytes:
    """The bytes of a file.

    Raises
    ------
    FileFormatError
        If it cannot be read, is no file, is empty, or has more than `limit` bytes.
    """
    try:
        if not path.is_file():
            raise FileFormatError(f"{path} is not a file")
        with path.open("rb") as file:
            data = file.read(limit + 1)
    except (OSError, ValueError) as error:
        raise FileFormatError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if len(data) > limit:
        raise FileFormatError(f"{path} has more than {limit // 2**20} MiB: not a camera file")
    if not data:
        raise FileFormatError(f"{path} is empty")
    return data


def read_text(path: Path, limit: int = MAX_BYTES) -> str:
    """The text of a file: UTF-8, UTF-16 with a byte order mark, or else Latin-1; lines end in a line feed.

    Raises
    ------
    FileFormatError
        As `read_bytes`; or if it is not text.
    """
    text = _decoded(read_bytes(path, limit))
    if "\0" in text:
        raise FileFormatError(f"{path} is binary, text was expected")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def head(path: Path, count: int = 65536) -> str:
    """The first bytes of a file as text, to recognise it by; empty where there are none or they are no text."""
    try:
        if not path.is_file():
            return ""
        with path.open("rb") as file:
            text = _decoded(file.read(count))
    except (OSError, ValueError):
        return ""
    return "" if "\0" in text else text


def _decoded(data: bytes) -> str:
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return data.decode("utf-16", errors="replace")
    if data.startswith(b"\xef\xbb\xbf"):
        data = data[3:]
    try:
        return data.decode("utf-8")
    except UnicodeDecodeError as error:
        cut = len(data) - error.start < 4  # `head` may have cut a character in two
        return data[: error.start].decode("utf-8") if cut else data.decode("latin-1")


def set_once(container: dict[str, Any], key: str, value: Any) -> None:
    """Put a value into a dictionary; `Repeated` where its key has another one."""
    container[key] = Repeated() if key in container and container[key] != value else value


def parse_json(text: str) -> Any:
    """The value of a JSON text; also with comments, NaN and numbers as OpenCV writes them.

    Raises
    ------
    FileFormatError
    """
    _check_containers(text)
    try:
        try:
            value = json.loads(text, object_pairs_hook=once)
        except ValueError:
            value = json.loads(JSON_TOKEN.sub(_strict_json, text), object_pairs_hook=once)
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"not valid JSON: {error}") from None
    _check_depth(value)
    return value


def _strict_json(token: re.Match[str]) -> str:
    if token[0].startswith('"'):
        return token[0]
    if token[0].startswith("/"):
        return " "
    if token[2]:
        return f"{token[1]}{'NaN' if token[2] == 'Nan' else 'Infinity'}"
    return f"{token[0]}0" if token[0].endswith(".") else token[0]


def once(pairs: Iterable[tuple[str, Any]]) -> dict[str, Any]:
    """A dictionary of pairs; `Repeated` stands where a key has two different values."""
    values: dict[str, Any] = {}
    for key, value in pairs:
        set_once(values, key, value)
    return values


def parse_toml(text: str) -> dict[str, Any]:
    """The tables of a TOML text.

    Raises
    ------
    FileFormatError
    """
    _check_containers(text)
    if any(part.count(".") > MAX_DEPTH for part in re.split("[,=\n]", text)):  # dotted keys cost their length squared
        raise FileFormatError(f"nested more than {MAX_DEPTH} deep: not a camera file")
    try:
        values: dict[str, Any] = tomllib.loads(text)
        _check_depth(values)
    except (ValueError, RecursionError) as error:
        raise FileFormatError(f"not valid TOML: {error}") from None
    return values


def _check_containers(text: str) -> None:
    if text.count("[") + text.count("{") > MAX_CONTAINERS:
        raise FileFormatError(f"more than {MAX_CONTAINERS} lists: not a camera file")


def _check_depth(value: Any) -> None:
    level = [value]
    for _ in range(MAX_DEPTH):
        level = [child for parent in level for child in _children(parent)]
        if not level:
            return
    raise FileFormatError(f"nested more than {MAX_DEPTH} deep: not a camera file")


def _children(value: Any) -> Iterator[Any]:
    inside = value.values() if isinstance(value, dict) else value if isinstance(value, list) else ()
    return (child for child in inside if isinstance(child, dict | list))


def parse_xml(data: bytes) -> Element:
    """The root element of an XML file; entities of its own are refused.

    Parameters
    ----------
    data : bytes
        As `read_bytes` gives them: XML says its encoding itself.

    Raises
    ------
    FileFormatError
    """
    try:
        root: Element = fromstring(data)
    except (ParseError, DefusedXmlException, ValueError, LookupError, RecursionError) as error:
        raise FileFormatError(f"not valid XML: {error}") from None
    level = [root]
    for _ in range(MAX_DEPTH):
        level = [child for parent in level for child in parent]
        if not level:
            return root
    raise FileFormatError(f"nested more than {MAX_DEPTH} deep: not a camera file")
