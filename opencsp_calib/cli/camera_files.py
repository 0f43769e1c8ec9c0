"""Which camera a command line means: the options that choose it, and the camera itself, of any format we read."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from opencsp_calib.cli.console import say_problems

if TYPE_CHECKING:
    from opencsp_calib.camera import Camera

CameraFile = Annotated[Path, typer.Argument(metavar="CAMERA", help="A camera file of any format we read.")]
CameraName = Annotated[
    str | None, typer.Option("--camera", metavar="NAME", help="Which camera of a file that has several.")
]
FromFormat = Annotated[
    str | None, typer.Option("--from", metavar="FORMAT", help="The format, where it cannot be told.")
]
ImageSize = Annotated[str | None, typer.Option(metavar="WxH", help="The image size, where the file does not have it.")]


def camera_in(
    path: Path, name: str | None = None, image_size: str | None = None, *, where_several: bool = False
) -> "Camera":
    """The camera of a file in any format we read; an InputError if it is not exactly one of our models.

    `where_several` says that the name is only meant where the file has several cameras.
    """
    from opencsp_calib.camera_files import read_camera_file

    opened = read_camera_file(path, name, image_size=image_size, where_several=where_several)
    say_problems(opened.imported.notes)
    return opened.camera
