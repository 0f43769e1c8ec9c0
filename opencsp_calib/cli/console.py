"""Where the command line's words go: people read standard error, programs read standard output."""

import contextlib
import json
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from opencsp_calib.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

    from opencsp_calib.calibration import Calibration
    from opencsp_calib.detecting import Progress
    from opencsp_calib.detection import Observations, Problem

__all__ = [
    "complain",
    "detection_progress",
    "print_json",
    "progress_bar",
    "say",
    "say_judgement",
    "say_problems",
    "say_table",
    "say_unused",
]


MAX_NAMED = 8  # images in one line
PIPED_WIDTH = 200  # of a table in a file or pipe, which has no width of its own
CONTROLS = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f]")  # a terminal obeys them, wherever they come from
NUMBER = re.compile(r"[-+±]?[\d.]|nan|inf|-?$")  # how a cell of a column of numbers begins


def say(text: str) -> None:
    """A line for people; nobody is told where standard error is closed, or on a full disk."""
    with contextlib.suppress(OSError):
        _console().print(_visible(text))


def complain(text: str) -> None:
    """The one line that says what went wrong."""
    line = " ".join(text.split())
    say(f"error: {line}")


def say_problems(problems: "tuple[Problem, ...]") -> None:
    """Warnings, each on a line with its code; decisions that are only told are notes."""
    from opencsp_calib.judgement import REMARKS

    for problem in problems:
        say(f"{'note' if problem.code in REMARKS else 'warning'} [{problem.code}] {problem.message}")


def say_judgement(calibration: "Calibration") -> None:
    """What a person should know about a calibration, and last, for it is read first, whether to use it."""
    from opencsp_calib.judgement import conclusion, judge

    problems = judge(calibration)
    say_problems(problems)
    say(conclusion(problems).sentence)


def say_table(header: tuple[str, ...], rows: Sequence[tuple[str, ...]]) -> None:
    """A table for people: columns of numbers to the right."""
    from rich import box
    from rich.table import Table

    console = _console()
    if not console.is_terminal:
        console.width = PIPED_WIDTH
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for index, title in enumerate(header):
        numbers = index > 0 and all(NUMBER.match(row[index]) for row in rows)
        table.add_column(title, justify="right" if numbers else "left", no_wrap=index == 0, overflow="fold")
    for row in rows:
        table.add_row(*map(_visible, row))
    with contextlib.suppress(OSError):
        console.print(table, soft_wrap=False)


def print_json(content: Any) -> None:
    """One JSON object on standard output."""
    if sys.stdout is None:
        raise InputError("--json writes to standard output, which is closed")
    sys.stdout.write(json.dumps(content, indent=1, allow_nan=False) + "\n")
    sys.stdout.flush()


@contextmanager
def progress_bar(what: str) -> "Iterator[Callable[[int, int], None]]":
    """A progress bar with time left on a terminal; elsewhere nothing."""
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    console = _console()
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


@contextmanager
def detection_progress() -> "Iterator[Progress]":
    """A progress bar for looking at images."""
    with progress_bar("Finding corners") as advance:
        yield lambda done, total, _: advance(done, total)


def say_unused(observations: "Observations") -> None:
    """The images that take no part, and why; those of one reason in one line."""
    by_reason: dict[tuple[str, str], list[str]] = {}
    for view in observations.views:
        if view.status != "used":
            reason = view.problems[-1].message if view.problems else view.detection.reason
            by_reason.setdefault((view.status, reason), []).append(view.image)
    for (status, reason), images in by_reason.items():
        more = f" and {len(images) - MAX_NAMED} more" if len(images) > MAX_NAMED else ""
        say(f"{', '.join(images[:MAX_NAMED])}{more}: {status}: {reason}")


def _visible(text: str) -> str:
    """With control characters, as file names may have them, spelled out."""
    return CONTROLS.sub(lambda found: f"\\x{ord(found[0]):02x}", text)


def _console() -> "Console":
    from rich.console import Console

    return Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
