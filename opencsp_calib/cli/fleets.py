"""The command that calibrates many cameras: fleet."""

import time
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.console import print_json, progress_bar, say, say_table
from opencsp_calib.cli.solving_options import Model, SolverName
from opencsp_calib.counted import counted
from opencsp_calib.errors import CancelledError, InputError

if TYPE_CHECKING:
    from distributed import Client

    from opencsp_calib.fleet import FleetResult
    from opencsp_calib.fleet_file import FleetCamera

INDEX_FILE = "fleet.html"


def fleet(
    where: Annotated[
        Path,
        typer.Argument(
            metavar="DIR | fleet.yaml", help="A folder with a folder of photographs for each camera, or a file."
        ),
    ],
    board: Annotated[
        str | None,
        typer.Option(metavar="SPEC", help="The board of every camera to which the file gives none of its own."),
    ] = None,
    model: Model = None,
    solver: SolverName = None,
    jobs: args.Jobs = None,
    resume: args.Resume = False,
    scheduler: args.SchedulerAddress = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="DIR", help="For the results, a folder a camera; by default beside."),
    ] = None,
    json: args.Json = False,
) -> None:
    """Calibrate many cameras, a folder each; tell which are good, and which have changed since last time."""
    from opencsp_calib.fleet_file import find_fleet
    from opencsp_calib.report import write_fleet

    started = time.perf_counter()
    cameras = find_fleet(where, args.given(board=board, model=model, solver=solver))
    _check_asked(cameras, board, args.given(model=model, solver=solver))
    root = output or cameras[0].root
    with _workers(scheduler) as client:
        _make(root)
        results = _calibrated(cameras, root, resume, jobs, client)
    write_fleet(results, root.absolute().name, root / INDEX_FILE)
    _say_results(results)
    say(f"report saved: {root / INDEX_FILE}")
    if json:
        print_json(
            {
                "cameras": [result.as_json() for result in results],
                "report": str(root / INDEX_FILE),
                "seconds": round(time.perf_counter() - started, 3),
            }
        )
    if any(result.verdict in ("bad", "failed") for result in results):
        raise typer.Exit(1)


COMMANDS = (fleet,)


def _check_asked(cameras: "tuple[FleetCamera, ...]", board: str | None, solving: dict[str, str]) -> None:
    """Refuse what is asked of all cameras and none can do, before anything is begun."""
    from opencsp_calib.fleet import board_below
    from opencsp_calib.pipeline import check_solving

    if not any("board" in camera.settings for camera in cameras):
        raise InputError("which board was photographed is not said; add --board SPEC")
    if board is not None:
        board_below(cameras[0].root, board)
    check_solving(**solving)


def _make(root: Path) -> None:
    from opencsp_calib.atomic import check_writable

    try:
        root.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot write to {root}: {error.strerror}") from None
    check_writable(root / INDEX_FILE)


def _workers(scheduler: str | None) -> "AbstractContextManager[Client | None]":
    """One connection for all cameras, so that a wrong address is one mistake, told at once."""
    if scheduler is None:
        return nullcontext()
    from opencsp_calib.cluster import client_of

    return client_of(scheduler)


def _calibrated(
    cameras: "tuple[FleetCamera, ...]", root: Path, resume: bool, jobs: int | None, scheduler: "Client | None"
) -> "list[FleetResult]":
    """One after another, each with all cores; what was found is kept until all are done."""
    from opencsp_calib.fleet import CAMERA_FILE, calibrate_camera
    from opencsp_calib.journal import Journal, journal_beside
    from opencsp_calib.report import write_report

    results, journals = [], []

    def calibrated(camera: "FleetCamera", title: str, journal: Journal) -> "FleetResult":
        with progress_bar(title) as advance:
            return calibrate_camera(
                camera,
                root / camera.name,
                write_report,
                jobs=jobs,
                progress=lambda done, total, _: advance(done, total),
                journal=journal,
                scheduler=scheduler,
            )

    try:
        for number, camera in enumerate(cameras, 1):
            journals.append(Journal(journal_beside(root / camera.name / CAMERA_FILE), resume=resume))
            result = calibrated(camera, f"{camera.name} ({number} of {len(cameras)})", journals[-1])
            change = f"; {result.change.level} since last time" if result.change else ""
            say(f"{result.name}: {result.verdict}: {result.sentence}{change}")
            results.append(result)
    except (KeyboardInterrupt, CancelledError) as error:
        what = str(error) or "stopped"
        done = f"{len(results)} of {counted(len(cameras), 'camera is', 'cameras are')} done"
        raise CancelledError(f"{what}; {done}, and --resume goes on from there") from None
    for journal in journals:
        journal.remove()
    return results


def _say_results(results: "list[FleetResult]") -> None:
    rows = []
    for result in results:
        found = result.calibration
        used = f"{len(found.observations.used)} of {len(found.observations.views)}" if found else ""
        rms = f"{found.rms_px:.4f}" if found else ""
        rows.append((result.name, result.verdict, rms, used, result.change.level if result.change else ""))
    say_table(("camera", "verdict", "rms (px)", "images used", "since last time"), rows)
