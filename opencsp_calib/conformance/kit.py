"""What a check is, how a promise is stated, and how checks become tests."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypeAlias

from opencsp_calib.board import Board, CharucoBoard, Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.interfaces import Provided

__all__ = ["Check", "Promise", "Setup", "promise"]

Promise: TypeAlias = Callable[[Any, "Setup"], None]


@dataclass(frozen=True)
class Setup:
    """What only the plugin's author knows and its checks need.

    Parameters
    ----------
    boards : tuple of Board
        That a detector supports; by default a checkerboard and a ChArUco board.
    specs : tuple of str
        Descriptions that a board kind understands.
    samples : mapping of Path to mapping of str to Camera
        Files of a camera format, made by the other program, and the cameras that are in them.
    device : str, optional
        Of an image source, to take images from.
    settings : mapping of str to value
        To open that device with.
    """

    boards: tuple[Board, ...] = (Checkerboard(9, 6, 0.03), CharucoBoard(9, 7, 0.03, 0.022, "DICT_4X4_50"))
    specs: tuple[str, ...] = ()
    samples: Mapping[Path, Mapping[str, Camera]] = field(default_factory=dict)
    device: str | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Check:
    """One promise of the plugin contract, as a function of what is provided; raises AssertionError if it is broken.

    Parameters
    ----------
    name : str
        Such as ``residuals_are_predicted_minus_detected``.
    holds : callable
        Takes what is provided and the setup.
    setup : Setup
    runs : bool
        Whether what is provided must be able to run here.
    """

    name: str
    holds: Promise
    setup: Setup
    runs: bool = True

    def __call__(self, provided: Provided) -> None:
        """Check it; what it raises where it should not is a broken promise too."""
        try:
            self.holds(provided, self.setup)
        except AssertionError:
            raise
        except Exception as error:
            raise AssertionError(f"it raises {error!r}") from error


def promise(kept: object, broken: str) -> None:
    """Raise AssertionError, with what was broken and by how much, unless the promise is kept."""
    if not kept:
        raise AssertionError(broken)
