"""The command that opens the window: gui."""

from importlib.util import find_spec
from pathlib import Path
from typing import Annotated

import typer

from opencsp_calib.cli.console import say
from opencsp_calib.errors import InputError, MissingDependencyError

HOST = "127.0.0.1"


def gui(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Only files below it are read and written.")] = Path(),
    port: Annotated[int, typer.Option(min=0, max=65535, metavar="N", help="By default a free one.")] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the address in the browser.")] = True,
    host: Annotated[
        str,
        typer.Option(metavar="ADDRESS", help="Listen on another address, so that other machines can reach it."),
    ] = HOST,
) -> None:
    """Calibrate in a window of the browser."""
    from opencsp_calib.atomic import check_writable

    if not folder.is_dir():
        raise InputError(f"{folder} is not a folder; name the one that the photographs are in")
    check_writable(folder / "camera.h5")
    if find_spec("nicegui") is None:
        raise MissingDependencyError("the window needs NiceGUI: pip install 'opencsp-calib[gui]'")
    if host != HOST:
        say(
            f"warning: listening on {host}: whoever can reach this machine and learns the address below can read "
            f"and change the files in {folder.resolve()}, and nothing on the way is encrypted. Safer: leave --host "
            "away and forward the port: ssh -L 8080:127.0.0.1:PORT THIS-MACHINE"
        )
    from opencsp_calib.gui.loading import serve

    serve(folder, host, port, open_browser=browser)


COMMANDS = (gui,)
