"""Faults of more than a thousand kinds: nothing is lost, nothing wrong comes out, nothing is left behind."""

import os
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from faults import FAULTS, NAMES, SEALED, STEPS, Kind, damaged, failing, kinds, many_writers, odd_name, on_a_small_disk

KINDS = {kind.name: kind for kind in kinds()}
WRITTEN_ASIDE = [kind for kind in KINDS.values() if kind.name != "journal"]
SEEDS, LIMITS, ROUNDS = range(80), (0, 1, 50, 120, 5000, 15000), 20
SHARED = ("camera", "opencv", "board file")


@pytest.fixture
def place() -> Iterator[Path]:
    """A folder in memory where there is one: thousands of files flushed to a disk would take minutes."""
    memory = Path("/dev/shm")  # noqa: S108 - within it, a folder of our own
    with tempfile.TemporaryDirectory(dir=memory if os.access(memory, os.W_OK) else None) as folder:
        yield Path(folder)


def all_right(outcomes: Iterable[str]) -> None:
    """Every case is as it should be."""
    assert [outcome for outcome in outcomes if outcome] == []


@pytest.mark.parametrize("name", SEALED)
def test_damage_gives_an_error_or_what_was_written(name: str, place: Path) -> None:
    all_right(damaged(KINDS[name], place, seed) for seed in SEEDS)


@pytest.mark.parametrize("kind", WRITTEN_ASIDE, ids=lambda kind: kind.name)
def test_a_step_of_writing_that_fails(kind: Kind, place: Path) -> None:
    all_right(failing(kind, place, step, fault) for step in STEPS for fault in FAULTS)


@pytest.mark.skipif(sys.platform == "win32", reason="has no limit on the size of files")
@pytest.mark.parametrize("kind", WRITTEN_ASIDE, ids=lambda kind: kind.name)
def test_a_disk_that_is_full_in_the_middle(kind: Kind, place: Path) -> None:
    all_right(on_a_small_disk(kind, place, limit) for limit in LIMITS)


@pytest.mark.skipif(sys.platform == "win32", reason="does not have these names")
@pytest.mark.parametrize("name", NAMES)
def test_odd_names(name: str, place: Path) -> None:
    def cases() -> Iterator[str]:
        for index, kind in enumerate(KINDS.values()):
            folder = place / str(index)
            folder.mkdir()
            yield odd_name(kind, folder, name)

    all_right(cases())


@pytest.mark.parametrize("name", SHARED)
def test_many_writers_of_one_file(name: str, place: Path) -> None:
    all_right(many_writers(KINDS[name], place, ROUNDS))


def test_these_are_more_than_a_thousand_cases() -> None:
    aside = len(WRITTEN_ASIDE) * (len(STEPS) * len(FAULTS) + len(LIMITS))
    assert len(SEALED) * len(SEEDS) + aside + len(NAMES) * len(KINDS) + len(SHARED) * ROUNDS >= 1000
