"""Text files of strangers: bytes to text, and YAML, XML, JSON and TOML to plain dictionaries, lists and strings.

Every reader of this plugin goes through here, so that what a hostile file can cost is bounded in one place: size
before reading, depth before anything recurses, aliases before they multiply. Whatever is wrong with a file is a
FileFormatError. Numbers are left to `fields`: of YAML's scalars the text is taken as it stands, because by the rules
of YAML 1.1 ``1e-05`` is a string, ``0123`` is 83 and ``12:30:00`` is 45000.
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

import yaml
from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from opencsp_calib.errors import FileFormatError

tomllib: Any = importlib.import_module("tomllib" if sys.version_info >= (3, 11) else "tomli")

__all__ = ["MAX_BYTES", "Repeated", "head", "once", "parse_json", "parse_toml", "parse_xml", "parse_yaml", "read_bytes"]
__all__ += ["read_text"]

MAX_BYTES = 32 * 2**20
MAX_YAML = 8 * 2**20  # its parser takes a second a megabyte where nesting is deep
MAX_DEPTH = 64
MAX_CONTAINERS = 2_000_000  # lists and dictionaries of a JSON or TOML file: each costs a hundred times its two brackets
MAX_ALIASES = 1000

# Both must stay linear in the length of the text: an open string runs to the end, a number matches with or without a
# point, so that neither is tried again from each of its characters.
JSON_TOKEN = re.compile(r'"(?:[^"\\]|\\.)*(?:"|\Z)|//[^\n]*|(-?)\.(Nan|Inf)\b|-?\d+(?:\.(?!\d))?', re.DOTALL)
MISSING_SPACE = re.compile(r'^([ \t]*\w+):(?=[-+.\d"\'\[{!])', re.MULTILINE)


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


def parse_yaml(text: str) -> list[Any]:
    """The documents of a YAML text, scalars as strings; OpenCV's dialect too. Tags make nothing.

    Parameters
    ----------
    text : str

    Returns
    -------
    list
        Of dictionaries, lists and strings; `Repeated` stands where a key has two different values.

    Raises
    ------
    FileFormatError
    """
    if len(text) > MAX_YAML:
        raise FileFormatError(f"more than {MAX_YAML // 2**20} MiB of YAML: not a camera file")
    if text.lstrip().startswith("%YAML:"):
        text = MISSING_SPACE.sub(r"\1: ", text)  # OpenCV's own parser does not ask for the space
    text = re.sub(r"^%YAML[^\n]*$", "", text, flags=re.MULTILINE).expandtabs(4)
    builder = _YamlBuilder()
    try:
        for event in yaml.parse(text, Loader=getattr(yaml, "CBaseLoader", yaml.BaseLoader)):
            builder.take(event)
    except (yaml.YAMLError, ValueError) as error:
        mark = getattr(error, "problem_mark", None)
        where = f", line {mark.line + 1}" if mark else ""
        raise FileFormatError(f"not valid YAML: {getattr(error, 'problem', None) or error}{where}") from None
    return builder.documents


class _YamlBuilder:
    """Plain values from YAML's events, without recursion and without constructing anything else."""

    def __init__(self) -> None:
        self.documents: list[Any] = []
        self._open: list[tuple[Any, str | None, list[Any]]] = []  # container, anchor, [pending key]
        self._anchors: dict[str, Any] = {}
        self._aliases = 0

    def take(self, event: Any) -> None:
        """Go on by one event."""
        if isinstance(event, yaml.ScalarEvent):
            self._remember(event.anchor, event.value)
            self._place(event.value)
        elif isinstance(event, yaml.MappingStartEvent | yaml.SequenceStartEvent):
            if len(self._open) >= MAX_DEPTH:
                raise FileFormatError(f"nested more than {MAX_DEPTH} deep: not a camera file")
            value: Any = {} if isinstance(event, yaml.MappingStartEvent) else []
            self._open.append((value, event.anchor, []))
        elif isinstance(event, yaml.MappingEndEvent | yaml.SequenceEndEvent):
            value, anchor, _ = self._open.pop()
            self._remember(anchor, value)
            self._place(value)
        elif isinstance(event, yaml.AliasEvent):
            self._place(self._aliased(event.anchor))
        elif isinstance(event, yaml.DocumentStartEvent):
            self._anchors.clear()

    def _remember(self, anchor: str | None, value: Any) -> None:
        if anchor is not None:
            self._anchors[anchor] = value

    def _aliased(self, anchor: str | None) -> Any:
        self._aliases += 1
        nested = any(open_anchor is not None for _, open_anchor, _ in self._open)
        if nested or self._aliases > MAX_ALIASES or anchor is None or anchor not in self._anchors:
            raise FileFormatError("aliases within aliases, too many or to nothing: not a camera file")
        return self._anchors[anchor]

    def _place(self, value: Any) -> None:
        if not self._open:
            self.documents.append(value)
            return
        container, _, pending = self._open[-1]
        if isinstance(container, list):
            container.append(value)
        elif not pending:
            pending.append(value if isinstance(value, str) else str(type(value)))
        else:
            _set_once(container, pending.pop(), value)


def _set_once(container: dict[str, Any], key: str, value: Any) -> None:
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
        _set_once(values, key, value)
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
