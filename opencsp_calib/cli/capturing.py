"""The command that takes photographs: capture."""

import logging
import shlex
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.console import say
from opencsp_calib.errors import InputError

if TYPE_CHECKING:
    from opencsp_calib.capture import Capture, CaptureFolder
    from opencsp_calib.coach import Knowledge
    from opencsp_calib.interfaces import ImageSource

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
    from opencsp_calib import pipeline
    from opencsp_calib.capture import Capture, CaptureFolder, release_from
    from opencsp_calib.looking import Search
    from opencsp_calib.registry import installed

    registry = installed()
    found = pipeline.board_from(board)
    detector = registry.detector_for(found)
    chosen, how, values = registry.image_source(source), release_from(release), settings_from(settings or [])
    device = _device(chosen, device, folder)
    photographs = CaptureFolder.opened(folder, found.spec, source, device)
    before = len(photographs.images)
    if before:
        say(f"{folder} has {before} photographs already: going on after them")
    search = Search(found, detector, "model" if detector.feature == "corner" else "none")
    run = Capture(photographs, search, how, count, range_m=working_range, goal_px=goal)
    knowledge = _run(run, chosen, device, values)
    _say_end(photographs, count, knowledge, board)
    if not photographs.images:
        raise typer.Exit(FINISHED_WITH_NOTHING)


COMMANDS = (capture,)


def settings_from(pairs: list[str]) -> dict[str, str]:
    """What ``--set FEATURE=VALUE`` says, in order; of a feature set twice the last."""
    values: dict[str, str] = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not (equals and name.strip()):
            raise InputError(f"--set takes FEATURE=VALUE, such as --set ExposureTime=5000, not {pair!r}")
        values.pop(name.strip(), None)
        values[name.strip()] = value.strip()
    return values


def _device(source: "ImageSource", device: str | None, folder: Path) -> str:
    """The device named; else the first there is."""
    if device is None:
        there = list(source.devices())
        if len(there) > 1:
            say(f"of {len(there)} cameras {there[0]} is taken; name another with --device: {', '.join(there[1:])}")
        return there[0] if there else ""
    if Path(device).exists() and folder.exists() and Path(device).samefile(folder):
        raise InputError(f"images cannot be taken from {device} into the same folder; name another DIR")
    return device


def _run(run: "Capture", source: "ImageSource", device: str, settings: dict[str, str]) -> "Knowledge | None":
    """The capture, shown live; whatever stops it, the photographs taken are safe."""
    from threadpoolctl import threadpool_limits

    from opencsp_calib.cli.keys import keys_pressed
    from opencsp_calib.cli.live import LiveText
    from opencsp_calib.opencv import opencv_on_one_thread

    keys = {" ": run.press, "d": run.delete_last, "q": run.stop}
    try:
        with (
            threadpool_limits(1),  # small matrices: threads would only get in each other's way
            opencv_on_one_thread(),
            LiveText(run.release) as live,
            _told(live.say),
            keys_pressed(keys),
            source.open(device, **settings) as images,
        ):
            return run.run(images, live.show)
    except InputError as error:
        taken = len(run.folder.images)
        if taken:
            raise InputError(f"{error}; {_safe(run.folder, taken)}") from None
        raise
    except KeyboardInterrupt:
        say(f"stopped: {_safe(run.folder, len(run.folder.images))}")
        raise typer.Exit(1) from None


def _safe(folder: "CaptureFolder", taken: int) -> str:
    return f"the {taken} photographs taken are safe in {folder.path}, and the same command goes on after them"


@contextmanager
def _told(tell: Callable[[str], None]) -> Iterator[None]:
    """What a source has to say while it works, such as what it set in the camera, shown to the person."""
    logger = logging.getLogger("opencsp_calib")
    handler = _Teller(tell)
    level = logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)


class _Teller(logging.Handler):
    def __init__(self, tell: Callable[[str], None]) -> None:
        super().__init__()
        self._tell = tell

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a message on."""
        self._tell(record.getMessage())


def _say_end(folder: "CaptureFolder", count: int, knowledge: "Knowledge | None", board: str) -> None:
    taken = len(folder.images)
    say(f"{taken} of {count} photographs are in {folder.path}")
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
