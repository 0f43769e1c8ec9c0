"""The commands that look through a camera: show, compare, undistort."""

from pathlib import Path
from typing import Annotated

import typer

from opencsp_calib.cli import arguments as args
from opencsp_calib.cli.camera_files import (
    CameraFile,
    CameraName,
    FromFormat,
    ImageSize,
    camera_in,
)
from opencsp_calib.cli.console import print_json, progress_bar, say, say_judgement, say_problems, say_table
from opencsp_calib.counted import counted
from opencsp_calib.errors import InputError


def show(
    file: CameraFile,
    camera: CameraName = None,
    from_format: FromFormat = None,
    image_size: ImageSize = None,
    json: args.Json = False,
) -> None:
    """Show a camera file: parameters with their sigmas, the record kept with it, and what to know about it."""
    from opencsp_calib.camera_files import read_camera_file
    from opencsp_calib.summary import camera_as_json, parameter_lines

    opened = read_camera_file(file, camera, from_format, image_size)
    calibration, record, shown = opened.calibration, opened.record, opened.camera
    sigma = calibration.sigma if calibration else None
    size = "x".join(map(str, shown.image_size))
    say(f"{shown.name}: {shown.model}, {size}")
    say_table(("parameter", "value", "±1 sigma"), parameter_lines(shown, sigma, record))
    for key, value in record.items():
        say(f"{key}: {value}")
    say_problems(opened.imported.notes)
    if calibration:
        views = len(calibration.observations.used)
        say(f"calibrated by {calibration.solver} from {views} views, rms {calibration.rms_px:.4f} px")
        say_judgement(calibration)
    if json:
        print_json(camera_as_json(shown, sigma))


def compare(
    a: Annotated[Path, typer.Argument(metavar="A", help="A camera file of any format we read.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="Another camera file, to compare it with.")],
    camera: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Which camera of a file that has several; given twice, of A and of B."),
    ] = None,
    image_size: ImageSize = None,
    range_m: Annotated[
        float | None,
        typer.Option("--range", min=1e-6, metavar="M", help="At this distance; by default at infinity."),
    ] = None,
    plot: Annotated[Path | None, typer.Option(metavar="FILE", help="A picture of the difference.")] = None,
    json: args.Json = False,
) -> None:
    """Compare two cameras by what they see: pixels over the image, once their frames are aligned."""
    from opencsp_calib.atomic import check_writable
    from opencsp_calib.comparison import compare as compared

    if plot:
        from opencsp_calib.report.figures import figure_format

        check_writable(plot)
        figure_format(plot)
    if len(camera or []) > 2:
        raise InputError("compare takes two cameras: give --camera once, or once for A and once for B")
    of_a, of_b = (camera * 2)[:2] if camera else (None, None)
    once = of_a if camera and len(camera) == 1 else None
    left, right = (
        camera_in(file, name, image_size, where_several=once is not None) for file, name in ((a, of_a), (b, of_b))
    )
    difference = compared(left, right, range_m=range_m)
    say(str(difference))
    if plot:
        from opencsp_calib.report import plot_difference

        plot_difference(difference, plot)
        say(f"plot saved: {plot}")
    if json:
        keys = ("rms_px", "median_px", "worst_px", "rotation_deg", "range_m")
        print_json({key: getattr(difference, key) for key in keys})


def undistort(
    camera: CameraFile,
    images: args.Images,
    output: Annotated[Path, typer.Option("-o", "--output", metavar="DIR", help="Folder for the new images.")],
    name: CameraName = None,
    image_size: ImageSize = None,
) -> None:
    """Remove the lens distortion from images; they come out as a pinhole camera would have taken them."""
    from opencsp_calib.images import find_images
    from opencsp_calib.undistortion import undistort_images

    lens = camera_in(camera, name, image_size)
    files = find_images(images)
    with progress_bar("Undistorting") as advance:
        undistort_images(lens, files, output, advance)
    say(f"{counted(len(files), 'image')} saved in {output}")


COMMANDS = (show, compare, undistort)
