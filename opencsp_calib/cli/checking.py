"""The commands that check: validate, check."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from opencsp_calib.cli.console import detection_progress, say_unused
from opencsp_calib.errors import InputError

if TYPE_CHECKING:
    from opencsp_calib.detection import Observations

COMMANDS: tuple[Any, ...] = ()


def observed(images: list[str], board: str | None, jobs: int | None = None) -> "Observations":
    """What is seen in photographs, or what a camera file or observations file says was seen."""
    from opencsp_calib import pipeline
    from opencsp_calib.hdf5_calibration import load_observations

    if len(images) == 1 and Path(images[0]).suffix.lower() in (".h5", ".hdf5"):
        return load_observations(images[0])
    if board is None:
        raise InputError("photographs need --board SPEC, such as --board checkerboard:18x23:50mm")
    with detection_progress() as progress:
        observations = pipeline.detect(images, pipeline.board_from(board), jobs=jobs, progress=progress)
    say_unused(observations)
    return observations
