"""Faults of more than a thousand kinds: nothing is lost, nothing wrong comes out, nothing is left behind."""

import os
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from faults import FAULTS, NAMES, SEALED, STEPS, Kind, damaged, failing, kinds, many_writers, odd_name, on_a_small_disk

KINDS = {kind.name: kind for kind in kinds()}
WRITTEN_ASIDE = [kind for kind in KINDS.values() if kind.name != "journal"]
COUNTED: Counter[str] = Counter()


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder in memory where there is one: thousands of files flushed to a disk would take minutes."""
    memory = Path("/dev/shm")  # noqa: S108 - within it, a folder of our own
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else None) as folder:
        yield Path(folder)


def all_right(group: str, outcomes: Iterator[str]) -> None:
    """Every case is as it should be; they are counted."""
    found = list(outcomes)
    COUNTED[group] += len(found)
    assert [outcome for outcome in found if outcome] == []


@pytest.mark.parametrize("name", SEALED)
def test_damage_gives_an_error_or_what_was_written(name: str, place: Path) -> None:
    all_right("damaged", (damaged(KINDS[name], place, seed) for seed in range(80)))


@pytest.mark.parametrize("kind", WRITTEN_ASIDE, ids=lambda kind: kind.name)
def test_a_step_of_writing_that_fails(kind: Kind, place: Path) -> None:
    all_right("failing", (failing(kind, place, step, fault) for step in STEPS for fault in FAULTS))


@pytest.mark.skipif(sys.platform == "win32", reason="has no limit on the size of files")
@pytest.mark.parametrize("kind", WRITTEN_ASIDE, ids=lambda kind: kind.name)
def test_a_disk_that_is_full_in_the_middle(kind: Kind, place: Path) -> None:
    all_right("full", (on_a_small_disk(kind, place, limit) for limit in (0, 1, 50, 120, 5000)))


@pytest.mark.skipif(sys.platform == "win32", reason="does not have these names")
@pytest.mark.parametrize("name", NAMES)
def test_odd_names(name: str, place: Path) -> None:
    def cases() -> Iterator[str]:
        for index, kind in enumerate(KINDS.values()):
            folder = place / str(index)
            folder.mkdir()
            yield odd_name(kind, folder, name)

    all_right("named", cases())


@pytest.mark.parametrize("name", ["camera", "opencv", "board file"])
def test_many_writers_of_one_file(name: str, place: Path) -> None:
    all_right("concurrent", iter(many_writers(KINDS[name], place, 20)))


def test_more_than_a_thousand_cases() -> None:
    """Of all of them together, when this whole file has run."""
    if len(COUNTED) == 5:
        assert COUNTED.total() >= 1000
