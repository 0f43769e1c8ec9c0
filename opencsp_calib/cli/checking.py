"""The commands that check: validate, check."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.camera_files import CameraFile, CameraName, ImageSize
from opencsp_calib.cli.console import print_json, say, say_problems, say_table
from opencsp_calib.cli.finding import detected_aloud
from opencsp_calib.cli.targets import check_targets
from opencsp_calib.errors import FileFormatError, InputError

if TYPE_CHECKING:
    from opencsp_calib.board import Board
    from opencsp_calib.calibration import Calibration
    from opencsp_calib.detection import Observations
    from opencsp_calib.interfaces import Solver
    from opencsp_calib.validate import Validation

MAX_SHOWN = 12


def validate(
    images: Annotated[
        list[str], typer.Argument(metavar="FILE | IMAGES...", help="A camera or observations file, or photographs.")
    ],
    board: args.OptionalBoardSpec = None,
    solvers: Annotated[str | None, typer.Option(metavar="a,b,c", help="By default all that are installed.")] = None,
    jobs: args.Jobs = None,
    report: args.Report = None,
    json: args.Json = False,
) -> None:
    """Let every solver, both halves of the views, and lens models from simple to rich answer the same question."""
    from opencsp_calib.report import write_validation
    from opencsp_calib.validate import validate as validated

    check_targets(report=report)
    engines = _chosen(solvers)
    found = validated(_calibration(images, board, jobs), engines)
    _say_validation(found)
    if report:
        write_validation(found, report)
        say(f"report saved: {report}")
    if json:
        print_json(found.as_json())
    if found.verdict == "disagree" or (len(engines) > 1 and not found.pairs):  # those asked for could not run
        raise typer.Exit(1)


def check(
    camera: CameraFile,
    images: args.Images,
    board: args.OptionalBoardSpec = None,
    name: CameraName = None,
    image_size: ImageSize = None,
    jobs: args.Jobs = None,
    json: args.Json = False,
) -> None:
    """Check whether a camera is still good for photographs it has not seen."""
    from opencsp_calib import pipeline
    from opencsp_calib.camera_files import read_camera_file
    from opencsp_calib.check import check as checked

    opened = read_camera_file(camera, name, image_size=image_size)
    say_problems(opened.imported.notes)
    known, calibration = opened.camera, opened.calibration
    observations = _observed(images, board, jobs, calibration.observations.board if calibration else None)
    found = checked(known, observations, lambda views: pipeline.solve(views, known.model), calibration)
    say(f"{known.name}: {found.verdict}")
    for reason in found.reasons:
        say(reason)
    say_problems(found.problems)
    if json:
        print_json(found.as_json())
    if found.verdict != "ok":
        raise typer.Exit(1)


COMMANDS = (validate, check)


def _chosen(names: str | None) -> "dict[str, Solver]":
    """The solvers named, or all that can run here."""
    from opencsp_calib.registry import installed

    registry = installed()
    if names is not None:
        chosen = [name for name in (part.strip() for part in names.split(",")) if name]
        if not chosen:
            raise InputError(f"--solvers {names!r} names none; installed are: {', '.join(sorted(registry.solvers))}")
        return {name: registry.solver(name) for name in chosen}
    return {name: solver for name, solver in sorted(registry.solvers.items()) if solver.missing() is None}


def _calibration(images: list[str], board: str | None, jobs: int | None) -> "Calibration":
    """The one in a camera file; else solved for now."""
    from opencsp_calib import pipeline
    from opencsp_calib.hdf5_calibration import load_calibration

    if _is_file(images) and not board:
        try:
            return load_calibration(images[0])
        except FileFormatError:  # observations only, or damaged: then the next line says so
            pass
    return pipeline.solve(_observed(images, board, jobs))


def _observed(images: list[str], spec: str | None, jobs: int | None, usual: "Board | None" = None) -> "Observations":
    """What is seen in photographs, by default of the board that the camera was calibrated with; or what a file says.

    That board is taken as it was given: a shape solved together with the camera shares its errors, and is only the
    second choice (see `opencsp_calib.check`).
    """
    from opencsp_calib import pipeline
    from opencsp_calib.hdf5_calibration import load_observations
    from opencsp_calib.images import find_images

    if spec and _is_file(images):
        raise InputError(f"{images[0]} says which board it is of; leave out --board")
    if _is_file(images):
        return load_observations(images[0])
    board = pipeline.board_from(spec) if spec else usual
    find_images(images)  # whether they are there, before anything is asked for
    if board is None:
        raise InputError("photographs need --board SPEC, such as --board checkerboard:18x23:50mm")
    return detected_aloud(images, board, jobs=jobs)


def _is_file(images: list[str]) -> bool:
    from opencsp_calib.hdf5_reading import like_hdf5

    return len(images) == 1 and like_hdf5(Path(images[0]))


def _say_validation(found: "Validation") -> None:
    from opencsp_calib.validate import SENTENCES

    rows = [
        (result.name, result.version, f"{result.calibration.rms_px:.4f} px", f"{result.seconds:.2f} s")
        for result in found.solvers
    ]
    say_table(("solver", "version", "rms", "time"), rows)
    differences = [
        (f"{pair.a} - {pair.b}", f"{pair.difference.rms_px:.2g} px", f"{pair.difference.worst_px:.2g} px")
        for pair in found.pairs
    ]
    if differences:
        say_table(("difference over the image", "rms", "worst"), differences)
    say(SENTENCES[found.verdict])
    for reason in found.reasons[:MAX_SHOWN]:
        say(f"- {reason}")
