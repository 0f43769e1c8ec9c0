"""What docs/json.md says that commands print with ``--json``, held against what they print."""

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

PAGE = Path(__file__).resolve().parents[1] / "docs" / "json.md"
BY_MODEL = {"params", "sigma"}  # whose keys are the lens model's parameters


@cache
def documented() -> dict[str, Any]:
    """The example of each command."""
    sections = re.findall(r"^## ([^\n]*)\n(.*?)(?=^## |\Z)", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    examples = {}
    for title, text in sections:
        found = re.search(r"```json\n(.*?)```", text, re.DOTALL)
        examples |= {name: json.loads(found[1]) if found else None for name in re.findall(r"`(\w+)`", title)}
    examples["show"] = examples["calibrate"]["camera"]
    return examples


def assert_as_documented(command: str, printed: Any) -> None:
    """The same keys all the way down; null, and lists without an entry, are always right."""
    _assert_alike(documented()[command], printed, command)


def _assert_alike(example: Any, printed: Any, where: str) -> None:
    if printed is None or example is None:
        return
    if isinstance(example, dict):
        assert isinstance(printed, dict), where
        if where.rpartition(".")[2] in BY_MODEL:
            return
        if where == "validate.solvers":  # by the solvers' names
            example = dict.fromkeys(printed, example["bundle"])
        assert printed.keys() == example.keys(), where
        for key, value in example.items():
            _assert_alike(value, printed[key], f"{where}.{key}")
    elif isinstance(example, list):
        assert isinstance(printed, list), where
        for entry in printed[:3] if example else ():
            _assert_alike(example[0], entry, where)
    else:
        assert not isinstance(printed, dict | list), where
