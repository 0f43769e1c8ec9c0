"""The commands that calibrate: calibrate, detect, solve."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.console import print_json, progress_bar, say, say_judgement, say_table
from opencsp_calib.cli.finding import detected_aloud, kept_beside
from opencsp_calib.cli.solving_options import with_solving_options
from opencsp_calib.cli.targets import check_not_input, check_targets
from opencsp_calib.counted import counted
from opencsp_calib.errors import InputError

if TYPE_CHECKING:
    from opencsp_calib.calibration import Calibration
    from opencsp_calib.detection import Observations


@with_solving_options
def calibrate(
    images: args.Images,
    board: args.BoardSpec,
    solving: dict[str, Any],
    name: Annotated[str | None, typer.Option(help="The camera's name; by default the folder's.")] = None,
    detector: args.DetectorName = None,
    refine: args.RefineBy = None,
    preset: Annotated[
        Literal["opencsp"] | None, typer.Option(help="Do exactly what OpenCSP's own calibration does.")
    ] = None,
    exclude: Annotated[list[str] | None, typer.Option(metavar="NAME", help="Leave out an image.")] = None,
    drop_worst: Annotated[int, typer.Option(min=0, metavar="N", help="Leave out the N worst views, solve again.")] = 0,
    max_rms: Annotated[
        float | None, typer.Option(min=0, metavar="PX", help="Leave out views above this rms, solve again.")
    ] = None,
    select: Annotated[
        int | None, typer.Option(min=3, metavar="N", help="Keep only the N views that together tell most.")
    ] = None,
    pixel_pitch: Annotated[
        float | None,
        typer.Option(min=0.01, max=1000, metavar="UM", help="Pixel size, to show focal length in mm."),
    ] = None,
    note: Annotated[
        list[str] | None, typer.Option(metavar="KEY=VALUE", help="To keep with the camera: focus, aperture ...")
    ] = None,
    jobs: args.Jobs = None,
    resume: args.Resume = False,
    scheduler: args.SchedulerAddress = None,
    output: args.Output = None,
    report: args.Report = None,
    json: args.Json = False,
) -> None:
    """Calibrate a camera from photographs of a board.

    The exit code is 0 when there is a camera, even one of which is said last that it should not be used; 1 when there
    is none; 2 where something given is wrong.
    """
    from opencsp_calib import dropping, pipeline
    from opencsp_calib.images import as_text, find_images

    check_targets(output, report)
    options = _preset(preset, args.given(detector=detector, refine=refine) | solving)
    finding = {key: options.pop(key) for key in ("detector", "refine") if key in options}
    started = time.perf_counter()
    target = pipeline.board_from(board)
    pipeline.check_solving(**options)
    files = find_images(images)
    check_not_input((file.path for file in files), output, report)
    dropping.check_dropping([file.name for file in files], exclude or [], drop_worst, select)
    record = _record(note or [], pixel_pitch)
    options |= {
        "name": name or as_text(files[0].path.absolute().parent.name),
        "record": record,
        "provenance": pipeline.places_of(images),
    }

    def run(views: "Observations") -> "Calibration":
        return pipeline.solve(views, **options)

    with kept_beside(output, resume) as journal:
        observations = detected_aloud(images, target, jobs=jobs, journal=journal, scheduler=scheduler, **finding)
        detected = time.perf_counter()
        observations = dropping.excluding(observations, exclude or [])
        observations = _selected(observations, select, options) if select else observations
        first = run(observations)
        result = dropping.drop_worst(first, drop_worst, run) if drop_worst else first
        result = dropping.drop_above(result, max_rms, run) if max_rms is not None else result
        solved = time.perf_counter()
        seconds = {"detect": detected - started, "solve": solved - detected, "total": solved - started}
        before = first if result is not first else None
        _finish(result, before, seconds, output, report, json)


def detect(
    images: args.Images,
    board: args.BoardSpec,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="FILE", help="The observations file to write.")],
    detector: args.DetectorName = None,
    refine: args.RefineBy = None,
    jobs: args.Jobs = None,
    resume: args.Resume = False,
    scheduler: args.SchedulerAddress = None,
    json: args.Json = False,
) -> None:
    """Find the board in photographs, and keep what was found for `solve`."""
    from opencsp_calib import pipeline
    from opencsp_calib.detecting import check_board_seen
    from opencsp_calib.hdf5_calibration import save_observations
    from opencsp_calib.summary import observations_as_json

    check_targets(output)
    started = time.perf_counter()
    target = pipeline.board_from(board)
    with kept_beside(output, resume) as journal:
        found = detected_aloud(
            images, target, journal, jobs=jobs, scheduler=scheduler, detector=detector, refine=refine
        )
        check_board_seen(found)
        save_observations(found, output)
    seconds = {"detect": time.perf_counter() - started}
    say(f"{_count(found)}; saved {output}")
    if json:
        print_json(observations_as_json(found, seconds, str(output)))


@with_solving_options
def solve(
    file: Annotated[
        Path, typer.Argument(metavar="FILE", help="An observations file, or a camera file to solve again.")
    ],
    solving: dict[str, Any],
    output: args.Output = None,
    report: args.Report = None,
    json: args.Json = False,
) -> None:
    """Solve again from what `detect` or `calibrate` kept; a camera file repeats its own run unless told otherwise."""
    from opencsp_calib import pipeline
    from opencsp_calib.hdf5_calibration import load_observations

    check_targets(output, report)
    check_not_input([file], output)
    observations = load_observations(file)
    started = time.perf_counter()
    result = pipeline.solve(observations, **{"name": file.stem, **_as_before(file), **solving})
    seconds = {"detect": 0.0, "solve": time.perf_counter() - started, "total": time.perf_counter() - started}
    _finish(result, None, seconds, output, report, json)


COMMANDS = (calibrate, detect, solve)


def _as_before(file: Path) -> dict[str, Any]:
    """How a camera file was solved; nothing for a file of observations only."""
    from opencsp_calib.hdf5_calibration import load_calibration
    from opencsp_calib.hdf5_reading import opened

    with opened(file) as content:
        if "Camera" not in content:
            return {}
    before = load_calibration(file)
    return {
        **before.repeated_by,
        "guess": before.options.guess,
        "name": before.camera.name,
        "record": before.record,
        "provenance": {key: before.provenance[key] for key in ("images",) if key in before.provenance},
    }


def _selected(observations: "Observations", count: int, options: dict[str, Any]) -> "Observations":
    from opencsp_calib import pipeline

    with progress_bar("Choosing views") as advance:
        found = pipeline.select(observations, count, progress=advance, **options)
    said = f"{len(found.observations.used)} of {found.of} views selected by what they tell"
    say(f"{said}; were errors independent, projections would be {found.loss:.2f} times as uncertain as from all")
    return found.observations


def _preset(preset: str | None, asked: dict[str, Any]) -> dict[str, Any]:
    """The options of a preset; with it, only the guess is free."""
    from opencsp_calib.options import PRESETS

    if preset is None:
        return asked
    meant = PRESETS[preset]
    for key, value in asked.items():
        if value != meant.get(key, value):
            means, typed = _as_typed(key, meant[key]), _as_typed(key, value)
            raise InputError(f"--preset {preset} means {means}; leave out {typed}, or the preset")
    return {**asked, **meant}


def _as_typed(key: str, value: Any) -> str:
    flag = key.replace("_", "-")
    if isinstance(value, bool):
        return f"--{flag}" if value else f"--no-{flag}"
    return f"--{flag} {value}"


def _record(notes: list[str], pixel_pitch: float | None) -> dict[str, str]:
    from opencsp_calib.summary import PIXEL_PITCH
    from opencsp_calib.typed import notes_from

    record = notes_from(notes)
    return record | ({PIXEL_PITCH: f"{pixel_pitch:g}"} if pixel_pitch else {})


def _finish(
    result: "Calibration",
    before: "Calibration | None",
    seconds: dict[str, float],
    output: Path | None,
    report: Path | None,
    json: bool,
) -> None:
    """Save, report, and tell."""
    from opencsp_calib.hdf5_calibration import save_calibration
    from opencsp_calib.summary import calibration_as_json

    if output:
        save_calibration(result, output)
    if report:
        from opencsp_calib.report import write_report

        write_report(result, report, before=before)
    _say_result(result, before)
    say_judgement(result)
    for what, path in (("camera", output), ("report", report)):
        if path:
            say(f"{what} saved: {path}")
    if not output:
        say("the camera was not saved; add -o camera.h5")
    if json:
        print_json(calibration_as_json(result, seconds, str(output) if output else None))


def _say_result(result: "Calibration", before: "Calibration | None") -> None:
    from opencsp_calib.summary import parameter_lines

    camera = result.camera
    size = "x".join(map(str, camera.image_size))
    say(f"{camera.name}: {camera.model}, {size}, {result.solver}, board {result.options.board_shape}")
    outliers = result.rejected_corners
    rejected = f", {counted(outliers, 'corner')} rejected" if outliers else ""
    say(f"{_count(result.observations)}, rms {result.rms_px:.4f} px{rejected}")
    if before is not None:
        say(f"before images were dropped: {_count(before.observations)}, rms {before.rms_px:.4f} px")
    say_table(("parameter", "value", "±1 sigma"), parameter_lines(camera, result.sigma, result.record))


def _count(observations: "Observations") -> str:
    corners = sum(len(detection) for detection in observations.detections)
    return f"{len(observations.used)} of {counted(len(observations.views), 'image')} used, {counted(corners, 'corner')}"
