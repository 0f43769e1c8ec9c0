"""The options that say how to solve, which `calibrate` and `solve` share, and what they mean for `pipeline.solve`."""

import inspect
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from opencsp_calib.cli.arguments import given
from opencsp_calib.errors import FileFormatError, InputError, MissingDependencyError

if TYPE_CHECKING:
    from opencsp_calib.camera import Camera

__all__ = ["Model", "SolverName", "with_solving_options"]

SOLVING = "Solving"

Model = Annotated[
    str | None,
    typer.Option(
        metavar="MODEL",
        help="The lens model: pinhole, opencv4, opencv5, opencv8, opencv12, opencv14 or opencv_fisheye.",
        show_default="opencv4",
        rich_help_panel=SOLVING,
    ),
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
BoardShape = Annotated[
    Literal["flat", "warp", "free", "auto"] | None,
    typer.Option(
        "--board-shape",
        help="Take the board as flat, with a smooth warp, or solve for every corner; auto decides from the data.",
        show_default="auto",
        rich_help_panel=SOLVING,
    ),
]
PixelAspect = Annotated[
    str | None,
    typer.Option(
        "--pixel-aspect",
        metavar="free|square|RATIO",
        help="Whether fx and fy are independent, equal, or in the ratio fy/fx.",
        show_default="free",
        rich_help_panel=SOLVING,
    ),
]
Weights = Annotated[
    Literal["equal", "covariance"] | None,
    typer.Option(
        "--weights",
        help="Whether all corners count the same, or each by its covariance; by default covariance for bundle.",
        rich_help_panel=SOLVING,
    ),
]
Robust = Annotated[
    bool | None,
    typer.Option(
        "--robust/--no-robust", help="Leave out outlying corners; by default for bundle.", rich_help_panel=SOLVING
    ),
]
Guess = Annotated[
    Path | None,
    typer.Option("--guess", metavar="CAMERA", help="A camera file to start from.", rich_help_panel=SOLVING),
]
OPTIONS = {
    "model": Model,
    "solver": SolverName,
    "board_shape": BoardShape,
    "pixel_aspect": PixelAspect,
    "weights": Weights,
    "robust": Robust,
    "guess": Guess,
}


def with_solving_options(command: Callable[..., None]) -> Callable[..., None]:
    """The command with all these options in the place of its argument `solving`: a dict of those that were given."""
    signature = inspect.signature(command)
    own = [parameter for name, parameter in signature.parameters.items() if name != "solving"]
    ours = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=None, annotation=kind)
        for name, kind in OPTIONS.items()
    ]

    @wraps(command)
    def run(**arguments: Any) -> None:
        from opencsp_calib.typed import aspect_from

        solving = {name: arguments.pop(name) for name in OPTIONS}
        solving["pixel_aspect"] = aspect_from(solving["pixel_aspect"])
        solving["guess"] = _guess(solving["guess"])
        command(**arguments, solving=given(**solving))

    run.__signature__ = signature.replace(parameters=[*own, *ours])  # type: ignore[attr-defined]  # what typer reads
    run.__annotations__ = {**command.__annotations__, **OPTIONS}
    return run


def _guess(path: Path | None) -> "Camera | None":
    """The camera that ``--guess`` names, in any format we read."""
    from opencsp_calib.cli.camera_files import camera_in

    if path is None:
        return None
    try:
        return camera_in(path)
    except InputError as error:
        if not path.is_file() or isinstance(error, FileFormatError | MissingDependencyError):
            raise
        raise InputError(f"{error}; `opencsp-calib convert` takes these options: start from what it writes") from None
