"""YAML of strangers, to plain dictionaries, lists and strings: depth is bounded, and aliases before they multiply.

Of scalars the text is taken as it stands, because by the rules of YAML 1.1 ``1e-05`` is a string, ``0123`` is 83 and
``12:30:00`` is 45000: numbers are left to `fields`.
"""

import re
from typing import Any

import yaml

from opencsp_calib.errors import FileFormatError
from opencsp_calib_formats.safe_text import MAX_DEPTH, set_once

__all__ = ["parse_yaml"]

MAX_YAML = 8 * 2**20  # its parser takes a second a megabyte where nesting is deep
MAX_ALIASES = 1000
MISSING_SPACE = re.compile(r'^([ \t]*\w+):(?=[-+.\d"\'\[{!])', re.MULTILINE)


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
            set_once(container, pending.pop(), value)
