"""The page of commands, from the command line's own help."""

import inspect
from collections.abc import Iterator
from typing import Any

import typer

from opencsp_calib.cli import app

__all__ = ["page"]

HEAD = """# Commands

Every command takes `--help`, which says the same. Exit codes: 0 done; 1 the calibration failed, or a verdict is
negative; 2 bad use or bad input. What is for people goes to standard error; `--json` puts one JSON object, and nothing
else, on standard output. IMAGES are files, folders or patterns such as `"photographs/*.png"`; a folder gives its image
files, sorted as people count. This page is made from the commands' own help when the documentation is built.
"""


def page() -> str:
    """The page in Markdown."""
    group = typer.main.get_command(app)
    sections = [HEAD]
    for name, command in group.commands.items():
        context = command.context_class(command, info_name=f"opencsp-calib {name}")
        usage = " ".join(command.get_usage(context).replace("Usage: ", "").split())
        sections += [f"## {name}", inspect.cleandoc(command.help or ""), f"```text\n{usage}\n```"]
        sections += _table(command, context)
    return "\n\n".join(sections) + "\n"


def _table(command: Any, context: Any) -> Iterator[str]:
    """What each argument and option is, as its help says."""
    records = [parameter.get_help_record(context) for parameter in command.get_params(context)]
    rows = [f"| `{_cell(name)}` | {_cell(said)} |" for name, said in filter(None, records) if "--help" not in name]
    if rows:
        yield "\n".join(["| | |", "|---|---|", *rows])


def _cell(text: str) -> str:
    """For a cell of a table."""
    return " ".join(text.split()).replace("|", "\\|")
