"""The command that takes photographs: capture."""

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.console import say
from opencsp_calib.counted import counted

if TYPE_CHECKING:
    from opencsp_calib.capture import CaptureFolder, Prepared
    from opencsp_calib.coach import Knowledge

FINISHED_WITH_NOTHING = 1


def capture(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Where the photographs go; goes on where it stopped.")],
    board: args.BoardSpec,
    source: Annotated[str, typer.Option(metavar="NAME", help="Where images come from: basler, folder, ...")] = "basler",
    device: Annotated[
        str | None, typer.Option(metavar="SERIAL", help="Which camera, by serial number; which folder, by path.")
    ] = None,
    count: Annotated[int, typer.Option(min=1, metavar="N", help="Photographs in all.")] = 50,
    release: Annotated[
        str,
        typer.Option(
            metavar="coach|interval:SECONDS|manual",
            help="Take a photograph when the coach finds it right, every so many seconds whatever the coach thinks, or "
            "with the space bar or Enter, which always works.",
        ),
    ] = "coach",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="FEATURE=VALUE", help="A setting of the camera; applied in the order given."),
    ] = None,
    working_range: Annotated[
        float | None,
        typer.Option("--range", min=1e-6, metavar="M", help="Distance at which the camera will work; by default far."),
    ] = None,
    goal: Annotated[
        float, typer.Option(min=1e-6, metavar="PX", help="Uncertainty of projections at which the coach is done.")
    ] = 0.1,
) -> None:
    """Take photographs of a board, with a coach that says where to hold it and releases at the right moment."""
    from opencsp_calib.capture import prepared, settings_from

    ready = prepared(
        folder,
        board,
        source=source,
        device=device,
        release=release,
        count=count,
        settings=settings_from(settings or []),
        range_m=working_range,
        goal_px=goal,
        tell=say,
    )
    knowledge = _run(ready)
    photographs = ready.capture.folder
    _say_end(photographs, count, knowledge, board)
    if not photographs.images:
        raise typer.Exit(FINISHED_WITH_NOTHING)


COMMANDS = (capture,)


def _run(ready: "Prepared") -> "Knowledge | None":
    """The capture, shown live; whatever stops it, the photographs taken are safe."""
    from opencsp_calib.cli.keys import keys_pressed
    from opencsp_calib.cli.live import LiveText

    run = ready.capture
    keys = {" ": run.press, "d": run.delete_last, "q": run.stop}
    try:
        with LiveText(run.release) as live, keys_pressed(keys):
            return ready.run(live.show, live.say)
    except KeyboardInterrupt:
        say(f"stopped: {ready.safe}")
        raise typer.Exit(1) from None


def _say_end(folder: "CaptureFolder", count: int, knowledge: "Knowledge | None", board: str) -> None:
    taken = len(folder.images)
    say(f"{taken} of {counted(count, 'photograph is', 'photographs are')} in {folder.path}")
    if not taken:
        return
    if knowledge is not None:
        if knowledge.sigma_px > 0:
            say(f"uncertainty of projections: {knowledge.sigma_px:.2g} px; the goal is {knowledge.goal_px:g} px")
        elif knowledge.why_not:
            say(knowledge.why_not)
        for lack in knowledge.lacks:
            say(f"still missing: {lack.message}")
    name, second = str(folder.path), f"{folder.path}-check"
    camera = f"{folder.path.absolute().name}.h5"
    say("next, calibrate:")
    say("  " + shlex.join(["opencsp-calib", "calibrate", name, "--board", board, "-o", camera]))
    say("then take a second, independent set of about 10 photographs, and check the camera with it:")
    say("  " + shlex.join(["opencsp-calib", "capture", second, "--board", board, "--count", "10"]) + _same(folder))
    say("  " + shlex.join(["opencsp-calib", "check", camera, second, "--board", board]))


def _same(folder: "CaptureFolder") -> str:
    source, device = folder.about["source"], folder.about["device"]
    return " " + shlex.join(["--source", source, "--device", device])
