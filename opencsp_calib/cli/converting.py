"""The commands that convert camera files and list their formats."""

from pathlib import Path
from typing import Annotated

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.camera_files import CameraName, FromFormat, ImageSize
from opencsp_calib.cli.console import print_json, say, say_problems, say_table
from opencsp_calib.cli.targets import check_not_input
from opencsp_calib.errors import InputError

Fit = Annotated[
    str | None, typer.Option("--fit", metavar="MODEL", help="Approximate a camera that is not exactly one of ours.")
]
AcceptError = Annotated[
    float | None, typer.Option(min=0, metavar="PX", help="The worst error of a fit that is accepted; default 0.1 px.")
]


def convert(
    source: Annotated[
        Path | None, typer.Argument(metavar="IN", help="The camera file; left out with --params.")
    ] = None,
    target: Annotated[Path | None, typer.Argument(metavar="OUT", help="The camera file to write.")] = None,
    from_format: FromFormat = None,
    to_format: Annotated[str | None, typer.Option("--to", metavar="FORMAT", help="The format to write.")] = None,
    camera: CameraName = None,
    fit: Fit = None,
    accept_error: AcceptError = None,
    image_size: ImageSize = None,
    params: Annotated[
        str | None, typer.Option(metavar="fx=..,fy=..,...", help="A camera typed by hand, with --model.")
    ] = None,
    model: Annotated[str | None, typer.Option(metavar="MODEL", help="The lens model of --params.")] = None,
    name: Annotated[str | None, typer.Option(help="The camera's name in the new file.")] = None,
    json: args.Json = False,
) -> None:
    """Convert a camera file from one program's format to another's: exactly, or by a fit that says its error."""
    from opencsp_calib import camera_files
    from opencsp_calib.atomic import check_writable
    from opencsp_calib.summary import camera_as_json
    from opencsp_calib.typed import camera_from

    typed_by_hand = params is not None
    out = source if typed_by_hand else target
    if source is None or out is None or (typed_by_hand and target is not None):
        raise InputError("convert takes IN and OUT, or with --params only OUT")
    if model is not None and not typed_by_hand:
        raise InputError("--model belongs to --params; another lens model for a camera file is asked for with --fit")
    check_writable(out)
    if params is not None:
        typed = camera_from(params, model, image_size, name or out.stem)
        converted = camera_files.Converted(typed, {})
    else:
        check_not_input([source], out)
        opened = camera_files.read_camera_file(source, camera, from_format, image_size)
        say_problems(opened.imported.notes)
        converted = camera_files.convert(opened, fit, accept_error, name)
    found = converted.fit
    if found:
        say(f"fitted {converted.record['import fit']}")
    warning = camera_files.write_camera_file(converted.camera, out, to_format, converted.record)
    say(f"camera saved: {out}")
    if warning:
        say(f"warning [notes-not-stored] {warning}")
    if json:
        keys = ("rms_px", "worst_px", "coverage")
        fit_as_json = {key: getattr(found, key) for key in keys} if found else None
        print_json({"camera": camera_as_json(converted.camera), "fit": fit_as_json, "output": str(out)})


def formats(json: args.Json = False) -> None:
    """List the camera file formats: which are read and written, and which lens models they carry exactly."""
    from opencsp_calib.registry import installed

    known = [format_ for _, format_ in sorted(installed().camera_formats.items())]
    fitted = {f.name: tuple(getattr(f, "fitted", ())) for f in known}  # not every plugin says
    can = {True: "yes", False: ""}
    rows = [
        (f.name, f.title, can[f.reads], can[f.writes], " ".join(f.models), ", ".join(fitted[f.name]), f.missing() or "")
        for f in known
    ]
    say_table(("format", "program and file", "read", "write", "exact as", "only with --fit", ""), rows)
    if json:
        keys = ("name", "title", "reads", "writes", "models", "extensions")
        more = [{"fitted": fitted[f.name], "missing": f.missing()} for f in known]
        listed = [{key: getattr(f, key) for key in keys} | rest for f, rest in zip(known, more, strict=True)]
        print_json({"formats": listed})


COMMANDS = (convert, formats)
