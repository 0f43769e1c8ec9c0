"""The command line, ``opencsp-calib``: a thin face of the pipeline.

Exit codes: 0 done; 1 the calibration failed, or a verdict is negative; 2 bad use or bad input. What is for people goes
to standard error; ``--json`` puts one JSON object, and nothing else, on standard output.
"""

import gc
import os
import re
import sys
import warnings
from typing import Any, TextIO

import typer

from opencsp_calib.cli import calibrating, cameras, capturing, checking, converting, fleets, setting_up, window
from opencsp_calib.cli.console import complain, say
from opencsp_calib.cli.help import CommandWithSections, first_line
from opencsp_calib.cli.setting_up import print_versions
from opencsp_calib.errors import CalibError, InputError
from opencsp_calib.stopping import stop_when_told, was_told

__all__ = ["app", "main"]

INTERRUPTED = 130  # what the argument parser returns for KeyboardInterrupt
NOTHING = re.compile(r"(--[\w-]+=)?\s*")  # as an argument

app = typer.Typer(
    name="opencsp-calib",
    help="Camera calibration that a metrologist trusts and a newcomer gets right the first time.",
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
for module in (calibrating, cameras, capturing, converting, checking, fleets, setting_up, window):
    for command in module.COMMANDS:
        app.command(cls=CommandWithSections, short_help=first_line(command))(command)


@app.callback(invoke_without_command=True)
def options(
    context: typer.Context,
    show_version: bool = typer.Option(False, "--version", help="Print the version, and those of the engines."),
) -> None:
    """Camera calibration that a metrologist trusts and a newcomer gets right the first time."""
    if show_version:
        print_versions()
        raise typer.Exit
    if context.invoked_subcommand is None:
        say(context.get_help())
        raise typer.Exit(2)


def main() -> None:
    """Run the command line; whatever goes wrong ends in one line and an exit code."""
    stop_when_told()
    gc.set_threshold(50_000)  # a command makes many objects and hardly a cycle: looking for some is a 20th of its time
    code = run(sys.argv[1:])
    written, _ = (_written(stream) for stream in (sys.stdout, sys.stderr))
    code = code or (0 if written else 2)
    gc.freeze()  # or Python would look for cycles among all it ever made before it ends, for nothing
    sys.exit(code)


def _written(stream: TextIO | None) -> bool:
    """Whether a full disk took all; if not, Python must not try again at its end, which has an exit code of its own."""
    if stream is None:  # closed
        return True
    try:
        stream.flush()
    except OSError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())
        return False
    return True


def run(arguments: list[str]) -> int:
    """Run one command, and give its exit code."""
    warnings.showwarning = lambda message, *_: say(f"warning: {message}")  # one line, without our source code
    try:
        _check_given(arguments)
        outcome = app(arguments, prog_name="opencsp-calib", standalone_mode=False)
    except CalibError as error:
        complain(str(error))
        return error.exit_code
    except (KeyboardInterrupt, typer.Abort):  # the second from older parsers
        outcome = INTERRUPTED
    except BrokenPipeError:  # the reader of our output has gone, as `| head` does: nobody is left to tell
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except OSError as error:  # what nobody foresaw: standard output on a full disk, a drive that has gone
        complain(f"{error.filename}: {error.strerror}" if error.filename else f"the system says: {error.strerror}")
        return 2
    except MemoryError:
        complain("there is not enough memory for this; use fewer --jobs, or smaller images")
        return 2
    except Exception as error:
        if was_told():  # NumPy, for one, turns an interruption into a TypeError
            outcome = INTERRUPTED
        elif hasattr(error, "format_message"):  # the argument parser's
            complain(_wrong_use(error))
            return 2
        else:  # a defect of ours, shown whole
            raise
    if outcome == INTERRUPTED:
        complain("stopped; what was not finished was not written")
        return 1
    return outcome if isinstance(outcome, int) else 0


def _check_given(arguments: list[str]) -> None:
    """Refuse an empty argument: to Python an empty path is the current folder, which nobody has named."""
    for before, argument in zip(["opencsp-calib", *arguments], arguments, strict=False):
        if NOTHING.fullmatch(argument):
            place = argument.rstrip(" =") or before
            raise InputError(f"nothing is given after {place}, only an empty text: a variable without a value, perhaps")


def _wrong_use(error: Any) -> str:
    """What the argument parser complains of, what to write where something is missing, and where to read more."""
    message = error.format_message().rstrip(".").replace(": Value error, ", ": ")  # newer parsers' words for theirs
    wanted = getattr(getattr(error, "param", None), "help", None)
    if type(error).__name__ == "MissingParameter" and wanted:
        message += f": {wanted.rstrip('.')}"
    context = getattr(error, "ctx", None)
    return f"{message}; see `{context.command_path} --help`" if context else message
