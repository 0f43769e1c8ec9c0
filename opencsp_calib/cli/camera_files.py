"""Which camera a command line means: the options that choose it, and the camera itself, of any format we read."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from opencsp_calib.cli.console import say_problems
from opencsp_calib.errors import InputError

if TYPE_CHECKING:
    from opencsp_calib.camera import Camera
    from opencsp_calib.interfaces import Imported

CameraFile = Annotated[Path, typer.Argument(metavar="CAMERA", help="A camera file of any format we read.")]
CameraName = Annotated[
    str | None, typer.Option("--camera", metavar="NAME", help="Which camera of a file that has several.")
]
FromFormat = Annotated[str | None, typer.Option("--from", metavar="F", help="The format, where it cannot be told.")]
ImageSize = Annotated[str | None, typer.Option(metavar="WxH", help="The image size, where the file does not have it.")]


def camera_in(
    path: Path, name: str | None = None, image_size: str | None = None, *, where_several: bool = False
) -> "Camera":
    """The camera of a file in any format we read; an InputError if it is not exactly one of our models.

    `where_several` says that the name is only meant where the file has several cameras.
    """
    from opencsp_calib.importing import exact

    _, imported = imported_from(path, name, image_size=image_size, where_several=where_several)
    say_problems(imported.notes)
    return exact(imported)


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


def record_in(path: Path) -> dict[str, str]:
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
