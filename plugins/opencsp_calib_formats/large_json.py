"""JSON files of reconstructions: cameras first, then perhaps hundreds of megabytes of points, which are not read."""

import json
import re
from pathlib import Path
from typing import Any

from opencsp_calib import Problem
from opencsp_calib.errors import FileFormatError
from opencsp_calib_formats.safe_text import MAX_BYTES, head, once, parse_json, read_text

__all__ = ["IN_PART", "read_json"]

IN_PART = Problem(
    "read-in-part",
    f"the file has more than {MAX_BYTES // 2**20} MiB; cameras beyond, as of further reconstructions, were not read",
)


def read_json(path: Path, *names: str) -> tuple[Any, bool]:
    """The content of a JSON file; of one that is too large to be read, the values of some names, and True.

    Parameters
    ----------
    path : Path
    names : str
        Of values in the outermost object, or in the first one of a list.

    Raises
    ------
    FileFormatError
        If it is no JSON; or if it is too large, and none of the values is within what is read of it.
    """
    if path.is_file() and path.stat().st_size <= MAX_BYTES:
        return parse_json(read_text(path)), False
    text = head(path, MAX_BYTES)
    found = {name: value for name in names if (value := _value(text, name)) is not None}
    if not found:
        raise FileFormatError(f"more than {MAX_BYTES // 2**20} MiB, and no {' or '.join(names)} at its beginning")
    return found, True


def _value(text: str, name: str) -> Any:
    """The first value of that name that is whole; None if there is none."""
    match = re.search(rf'"{name}"\s*:\s*', text)
    if match is None:
        return None
    try:
        value, end = json.JSONDecoder(object_pairs_hook=once).raw_decode(text, match.end())
        return parse_json(text[match.end() : end]) if isinstance(value, dict | list) else value
    except (ValueError, RecursionError):
        return None
