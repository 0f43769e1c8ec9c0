"""The arguments that several commands share."""

from pathlib import Path
from typing import Annotated, Any, Literal

import typer

OUTPUT = "Output"

Images = Annotated[list[str], typer.Argument(metavar="IMAGES", help="Image files, folders, or glob patterns.")]
BoardSpec = Annotated[
    str,
    typer.Option(
        "--board",
        metavar="SPEC",
        help="checkerboard:COLUMNSxROWS:SIZE (inner corners, either way round, such as checkerboard:18x23:50mm), "
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
    bool,
    typer.Option(
        "--resume", help="Go on from what an interrupted run has done: a .journal beside the output keeps it."
    ),
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


def given(**options: Any) -> dict[str, Any]:
    """Only the options that were given, so that defaults stay in one place."""
    return {name: value for name, value in options.items() if value is not None}
