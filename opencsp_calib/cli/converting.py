"""The commands that convert camera files and list their formats."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.camera_files import (
    CameraName,
    FromFormat,
    ImageSize,
    imported_from,
    record_in,
    size_from,
)
from opencsp_calib.cli.console import print_json, say, say_problems, say_table
from opencsp_calib.errors import InputError

if TYPE_CHECKING:
    from opencsp_calib.camera import Camera
    from opencsp_calib.detection import Problem
    from opencsp_calib.lens_fit import LensFit

Fit = Annotated[
    str | None, typer.Option("--fit", metavar="MODEL", help="Approximate a camera that is not exactly one of ours.")
]
AcceptError = Annotated[
    float | None, typer.Option(min=0, metavar="PX", help="The worst error of a fit that is accepted; default 0.1 px.")
]


def convert(
    source: Annotated[str, typer.Argument(metavar="IN", help="The camera file; left out with --params.")],
    target: Annotated[Path | None, typer.Argument(metavar="OUT", help="The camera file to write.")] = None,
    from_format: FromFormat = None,
    to_format: Annotated[str | None, typer.Option("--to", metavar="F", help="The format to write.")] = None,
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
    from dataclasses import replace

    from opencsp_calib.atomic import check_writable
    from opencsp_calib.importing import exact, fitted
    from opencsp_calib.summary import camera_as_json

    out = Path(source) if params is not None and target is None else target
    if out is None or (params is not None and target is not None):
        raise InputError("convert takes IN and OUT, or with --params only OUT")
    check_writable(out)
    found: LensFit | None = None
    record: dict[str, str] = {}
    if params is not None:
        converted = typed_camera(params, model, image_size, name or out.stem)
    else:
        key, imported = imported_from(Path(source), camera, from_format, image_size)
        say_problems(imported.notes)
        record = record_in(Path(source)) | _noted(imported.notes)
        if fit is not None:
            found = fitted(imported, fit, **args.given(accept_error_px=accept_error, name=name or key))
            record["import fit"] = f"{fit}, {found}"
            say(f"fitted {record['import fit']}")
            converted = found.camera
        else:
            converted = exact(imported)
    converted = replace(converted, name=name) if name else converted
    write_camera_file(converted, out, to_format, record)
    say(f"camera saved: {out}")
    if json:
        keys = ("rms_px", "worst_px", "coverage")
        fit_as_json = {key: getattr(found, key) for key in keys} if found else None
        print_json({"camera": camera_as_json(converted), "fit": fit_as_json, "output": str(out)})


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
        print_json([{key: getattr(f, key) for key in keys} | rest for f, rest in zip(known, more, strict=True)])


COMMANDS = (convert, formats)


def typed_camera(params: str, model: str | None, image_size: str | None, name: str) -> "Camera":
    """What ``--params`` says, with ``--model`` and ``--image-size``."""
    from opencsp_calib.camera import Camera
    from opencsp_calib.models import lens_model

    size = size_from(image_size)
    if model is None or size is None:
        raise InputError("--params needs --model and --image-size too")
    names = lens_model(model).parameter_names
    values = dict(_typed_number(pair) for pair in params.split(","))
    missing, unknown = [n for n in names if n not in values], [n for n in values if n not in names]
    if missing or unknown:
        what = f"lacks {', '.join(missing)}" if missing else f"has {', '.join(unknown)}, which it should not"
        raise InputError(f"--params {what}; {model} has {', '.join(names)}")
    return Camera(name, model, [values[n] for n in names], size)  # type: ignore[arg-type]  # made an array there


def write_camera_file(camera: "Camera", path: Path, to_format: str | None, record: dict[str, str]) -> None:
    """Write a camera in the format named, or that its extension means, with the record where there is room for it."""
    from opencsp_calib.interfaces import KeepsNotes
    from opencsp_calib.registry import installed

    writers = {name: f for name, f in installed().camera_formats.items() if f.writes}
    if to_format is not None and to_format not in writers:
        raise InputError(
            f"no format that can be written is called {to_format!r}; there are {', '.join(sorted(writers))}"
        )
    if to_format is None:
        fitting = [name for name, f in sorted(writers.items()) if path.suffix.lower() in f.extensions]
        if len(fitting) != 1:
            choice = ", ".join(fitting or sorted(writers))
            raise InputError(f"which format {path.name} should have cannot be told; add --to with one of {choice}")
        to_format = fitting[0]
    writer = writers[to_format]
    if record and isinstance(writer, KeepsNotes):
        writer.write_with_notes({camera.name: camera}, path, record)
        return
    writer.write({camera.name: camera}, path)
    if record:
        say(f"warning [notes-not-stored] {writer.title} has no room for notes; keep them yourself")


def _typed_number(pair: str) -> tuple[str, float]:
    name, _, value = pair.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise InputError(f"--params takes NAME=NUMBER, such as fx=2710.0, not {pair.strip()!r}") from None


def _noted(notes: "tuple[Problem, ...]") -> dict[str, str]:
    """Notes by their code, all messages of one code together."""
    found: dict[str, str] = {}
    for note in notes:
        key = f"import {note.code}"
        found[key] = f"{found[key]}; {note.message}" if key in found else note.message
    return found
