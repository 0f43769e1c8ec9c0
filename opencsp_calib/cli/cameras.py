"""The commands that handle camera files: show, compare, convert, formats, undistort."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.console import print_json, say, say_problems, say_table
from opencsp_calib.errors import InputError

if TYPE_CHECKING:
    from opencsp_calib.camera import Camera
    from opencsp_calib.detection import Problem
    from opencsp_calib.interfaces import Imported
    from opencsp_calib.lens_fit import LensFit

CameraFile = Annotated[Path, typer.Argument(metavar="CAMERA", help="A camera file of any format we read.")]
CameraName = Annotated[
    str | None, typer.Option("--camera", metavar="NAME", help="Which camera of a file that has several.")
]
FromFormat = Annotated[str | None, typer.Option("--from", metavar="F", help="The format, where it cannot be told.")]
ImageSize = Annotated[str | None, typer.Option(metavar="WxH", help="The image size, where the file does not have it.")]
Fit = Annotated[
    str | None, typer.Option("--fit", metavar="MODEL", help="Approximate a camera that is not exactly one of ours.")
]
AcceptError = Annotated[
    float | None, typer.Option(min=0, metavar="PX", help="The worst error of a fit that is accepted; default 0.1 px.")
]


def show(
    file: CameraFile,
    camera: CameraName = None,
    from_format: FromFormat = None,
    image_size: ImageSize = None,
    json: args.Json = False,
) -> None:
    """Show a camera file: parameters with their sigmas, the record kept with it, and what to know about it."""
    from opencsp_calib.summary import camera_as_json, parameter_lines

    name, imported = imported_from(file, camera, from_format, image_size)
    calibration = calibration_in(file)
    sigma = calibration.sigma if calibration else None
    record = _record_in(file)
    shown = _exact(imported, name)
    size = "x".join(map(str, shown.image_size))
    say(f"{shown.name}: {shown.model}, {size}")
    say_table(("parameter", "value", "±1 sigma"), parameter_lines(shown, sigma, record))
    for key, value in record.items():
        say(f"{key}: {value}")
    say_problems(imported.notes)
    if calibration:
        from opencsp_calib.judgement import judge

        views = len(calibration.observations.used)
        say(f"calibrated by {calibration.solver} from {views} views, rms {calibration.rms_px:.4f} px")
        say_problems(judge(calibration))
    if json:
        print_json(camera_as_json(shown, sigma))


def compare(
    a: CameraFile,
    b: CameraFile,
    camera: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Which camera of a file that has several; given twice, of A and of B."),
    ] = None,
    image_size: ImageSize = None,
    range_m: Annotated[float | None, typer.Option("--range", min=1e-6, metavar="M", help="At this distance.")] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="A picture of the difference.")] = None,
    json: args.Json = False,
) -> None:
    """Compare two cameras by what they see: pixels over the image, once their frames are aligned."""
    from opencsp_calib.atomic import check_writable
    from opencsp_calib.comparison import compare as compared

    if plot:
        check_writable(plot)
        if plot.suffix.lower() not in (".png", ".svg", ".pdf"):
            raise InputError(f"a plot is saved as .png, .svg or .pdf, not as {plot.name}")
    if len(camera or []) > 2:
        raise InputError("compare takes two cameras: give --camera once, or once for A and once for B")
    of_a, of_b = (camera * 2)[:2] if camera else (None, None)
    once = of_a if camera and len(camera) == 1 else None
    left, right = (
        camera_in(file, name, image_size, where_several=once is not None) for file, name in ((a, of_a), (b, of_b))
    )
    difference = compared(left, right, range_m=range_m)
    where = "at infinity" if range_m is None else f"at {range_m:g} m"
    say(
        f"{where}: rms {difference.rms_px:.4g} px, median {difference.median_px:.4g} px, "
        f"worst {difference.worst_px:.4g} px over the image, "
        f"after a turn of the frame by {difference.rotation_deg:.4g} degrees"
    )
    if plot:
        from opencsp_calib.report import plot_difference

        plot_difference(difference, plot)
        say(f"plot saved: {plot}")
    if json:
        keys = ("rms_px", "median_px", "worst_px", "rotation_deg", "range_m")
        print_json({key: getattr(difference, key) for key in keys})


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
    from opencsp_calib.importing import fitted
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
        record = _record_in(Path(source)) | _noted(imported.notes)
        if fit is not None:
            found = fitted(imported, fit, **args.given(accept_error_px=accept_error, name=name or key))
            record["import fit"] = f"{fit}, {found}"
            say(f"fitted {record['import fit']}")
            converted = found.camera
        else:
            converted = _exact(imported, key)
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


def undistort(
    camera: CameraFile,
    images: args.Images,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the new images.")],
    name: CameraName = None,
    image_size: ImageSize = None,
) -> None:
    """Remove the lens distortion from images; they come out as a pinhole camera would have taken them."""
    from opencsp_calib.images import find_images, read_image, write_image

    lens = camera_in(camera, name, image_size)
    files = find_images(images)
    if output.exists() and not output.is_dir():
        raise InputError(f"{output} is a file; give a folder")
    inputs = {file.path.absolute().parent for file in files}
    if output.absolute() in inputs:
        raise InputError(f"{output} holds the photographs themselves; give another folder")
    output.mkdir(parents=True, exist_ok=True)
    for file in files:
        target = output / Path(file.name).with_suffix(".png")
        target.parent.mkdir(parents=True, exist_ok=True)
        write_image(lens.undistort(read_image(file).pixels), target)
    say(f"{len(files)} images saved in {output}")


COMMANDS = (show, compare, convert, formats, undistort)


def camera_in(
    path: Path, name: str | None = None, image_size: str | None = None, *, where_several: bool = False
) -> "Camera":
    """The camera of a file in any format we read; an InputError if it is not exactly one of our models.

    `where_several` says that the name is only meant where the file has several cameras.
    """
    key, imported = imported_from(path, name, image_size=image_size, where_several=where_several)
    say_problems(imported.notes)
    return _exact(imported, key)


def imported_from(
    path: Path,
    name: str | None = None,
    from_format: str | None = None,
    image_size: str | None = None,
    *,
    where_several: bool = False,
) -> "tuple[str, Imported]":
    """One camera of a file, and its name there."""
    from opencsp_calib.importing import pick, read_cameras
    from opencsp_calib.registry import installed

    size = size_from(image_size)
    cameras = read_cameras(path, installed().camera_formats, size, from_format)
    return pick(cameras, None if where_several and len(cameras) == 1 else name)


def size_from(text: str | None) -> tuple[int, int] | None:
    """What ``--image-size`` says."""
    if text is None:
        return None
    width, x, height = text.lower().partition("x")
    if not (x and width.isdecimal() and height.isdecimal()):
        raise InputError(f"--image-size takes WIDTHxHEIGHT, such as 1626x1236, not {text!r}")
    return int(width), int(height)


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


def _exact(imported: "Imported", name: str) -> "Camera":
    from opencsp_calib.importing import exact

    return exact(imported)


def _record_in(path: Path) -> dict[str, str]:
    """The notes in one of our camera files; none in any other."""
    from opencsp_calib.errors import FileFormatError
    from opencsp_calib.hdf5 import load_record

    try:
        return load_record(path)
    except FileFormatError:
        return {}


def calibration_in(path: Path) -> Any:
    """The calibration in one of our camera files; None in any other."""
    from opencsp_calib.errors import FileFormatError
    from opencsp_calib.hdf5_calibration import load_calibration

    try:
        return load_calibration(path)
    except FileFormatError:
        return None
