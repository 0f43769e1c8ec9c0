"""One of something is not told as several."""

import re
from pathlib import Path

import pytest

import opencsp_calib
from opencsp_calib.counted import counted

ROOT = Path(opencsp_calib.__file__).parent.parent
BARE = re.compile(r"\{len\([^{}]*\)\} (photographs|images)\b")  # what there may well be one of


def test_one_is_not_several() -> None:
    assert [counted(n, "view") for n in (0, 1, 2)] == ["0 views", "1 view", "2 views"]
    assert [counted(n, "view has", "views have") for n in (1, 2)] == ["1 view has", "2 views have"]


@pytest.mark.parametrize("folder", ["opencsp_calib", "plugins"])
def test_no_message_counts_things_as_several_that_may_be_one(folder: str) -> None:
    bare = {}
    for path in sorted((ROOT / folder).rglob("*.py")):
        if found := BARE.search(path.read_text(encoding="utf-8")):
            bare[path.name] = found[0]
    assert not bare
