"""The arguments that several commands share."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from opencsp_calib.errors import FileFormatError, InputError, MissingDependencyError

if TYPE_CHECKING:
    from opencsp_calib.camera import Camera

SOLVING = "Solving"
OUTPUT = "Output"

Images = Annotated[list[str], typer.Argument(metavar="IMAGES", help="Image files, folders, or glob patterns.")]
BoardSpec = Annotated[
    str,
    typer.Option(
        "--board",
        metavar="SPEC",
        help="checkerboard:COLUMNSxROWS:SIZE (inner corners, such as checkerboard:18x23:50mm), "
        "charuco:COLUMNSxROWS:SQUARE:MARKER:DICTIONARY (squares; followed by :inverted or :legacy where it is so), "
        "or a board file.",
    ),
]
OptionalBoardSpec = Annotated[
    str | None, typer.Option("--board", metavar="SPEC", help="The board, where IMAGES are photographs.")
]
Json = Annotated[bool, typer.Option("--json", help="One JSON object on standard output.", rich_help_panel=OUTPUT)]
Output = Annotated[
    Path | None,
    typer.Option("-o", "--output", metavar="FILE", help="The camera file to write.", rich_help_panel=OUTPUT),
]
Report = Annotated[Path | None, typer.Option(metavar="FILE", help="An HTML report to write.", rich_help_panel=OUTPUT)]
Jobs = Annotated[
    int | None, typer.Option(min=1, max=1024, metavar="N", help="Images at a time; by default one per core.")
]
Resume = Annotated[
    bool, typer.Option("--resume", help="Go on from what an interrupted run has done: it is kept in FILE.journal.")
]
SchedulerAddress = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Look at images on a Dask cluster that you trust: its scheduler, such as tcp://10.0.0.5:8786.",
    ),
]
DetectorName = Annotated[str | None, typer.Option("--detector", metavar="NAME", help="Which detector looks for it.")]
RefineBy = Annotated[
    Literal["none", "subpix", "model"] | None,
    typer.Option(help="How corners are located: as found, by OpenCV's search, or by fitting the image of a corner."),
]
Model = Annotated[
    str | None, typer.Option(metavar="MODEL", help="The lens model.", show_default="opencv4", rich_help_panel=SOLVING)
]
SolverName = Annotated[
    str | None,
    typer.Option(
        "--solver",
        metavar="NAME",
        help="Which solver finds the camera; `plugins` lists them.",
        show_default="bundle",
        rich_help_panel=SOLVING,
    ),
]
BoardShapeOption = Annotated[
    Literal["flat", "warp", "free", "auto"] | None,
    typer.Option(
        "--board-shape",
        help="Take the board as flat, with a smooth warp, or solve for every corner; auto decides from the data.",
        show_default="auto",
        rich_help_panel=SOLVING,
    ),
]
PixelAspectOption = Annotated[
    str | None,
    typer.Option(
        "--pixel-aspect",
        metavar="free|square|RATIO",
        help="Whether fx and fy are independent, equal, or in the ratio fy/fx.",
        show_default="free",
        rich_help_panel=SOLVING,
    ),
]
WeightsOption = Annotated[
    Literal["equal", "covariance"] | None,
    typer.Option("--weights", help="By default covariance for bundle, else equal.", rich_help_panel=SOLVING),
]
RobustOption = Annotated[
    bool | None,
    typer.Option(
        "--robust/--no-robust", help="Leave out outlying corners; default for bundle.", rich_help_panel=SOLVING
    ),
]
GuessOption = Annotated[
    Path | None,
    typer.Option("--guess", metavar="CAMERA", help="A camera file to start from.", rich_help_panel=SOLVING),
]


def guess_from(path: Path | None) -> "Camera | None":
    """The camera that ``--guess`` names, in any format we read."""
    from opencsp_calib.cli.camera_files import camera_in

    if path is None:
        return None
    try:
        return camera_in(path)
    except (FileFormatError, MissingDependencyError):
        raise
    except InputError as error:
        raise InputError(f"--guess {path}: {error} (with `opencsp-calib convert`, and guess with its output)") from None


def given(**options: Any) -> dict[str, Any]:
    """Only the options that were given, so that defaults stay in one place."""
    return {name: value for name, value in options.items() if value is not None}
