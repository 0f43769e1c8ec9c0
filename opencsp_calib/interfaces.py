"""What a plugin provides: the promises that `conformance` checks."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol, runtime_checkable

from opencsp_calib.arrays import Pixels, Points
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Detection, Observations, Problem
from opencsp_calib.drawing import Drawing, Rectangle
from opencsp_calib.image import Image
from opencsp_calib.options import SolveOptions

__all__ = [
    "BoardKind",
    "CameraFormat",
    "Detector",
    "Drawing",
    "ImageSource",
    "Imported",
    "KeepsNotes",
    "Provided",
    "Rectangle",
    "Solver",
]


@runtime_checkable
class Provided(Protocol):
    """Anything a plugin provides.

    Attributes
    ----------
    name : str
        What the user types and files record.
    """

    name: str

    def missing(self) -> str | None:
        """One sentence naming what to install when it cannot run here; None when it can."""


@runtime_checkable
class Detector(Provided, Protocol):
    """Finds a board's corners in an image.

    Attributes
    ----------
    feature : 'corner' or 'own'
        Corners of a checkerboard are refined by `opencsp_calib.corners`; others are taken as they come.
    """

    feature: Literal["corner", "own"]

    def supports(self, board: Board) -> bool:
        """Whether it can look for this board."""

    def detect(self, image: Image, board: Board) -> Detection:
        """The corners found; none, with the reason, where the board is not to be seen. Never raises for an image."""


@runtime_checkable
class BoardKind(Provided, Protocol):
    """A kind of calibration target.

    Attributes
    ----------
    grammar : str
        How its description is written, such as ``checkerboard:COLUMNSxROWS:SIZE``.
    """

    grammar: str

    def parse(self, spec: str) -> Board:
        """The board of a description; raises BoardSpecError, whose message shows the grammar."""

    def draw(self, board: Board) -> Drawing:
        """How it is printed."""


@runtime_checkable
class Solver(Provided, Protocol):
    """Solves for the camera.

    Attributes
    ----------
    models : frozenset of str
        The lens models it can solve for.
    abilities : frozenset of str
        Of ``board_warp``, ``board_free``, ``pixel_aspect``, ``weights``, ``robust``, ``guess``.
    """

    models: frozenset[str]
    abilities: frozenset[str]

    def version(self) -> str:
        """Of the engine, such as ``5.0.0``."""

    def solve(self, observations: Observations, model: str, options: SolveOptions) -> Calibration:
        """The camera. Raises CalibrationFailedError rather than return what cannot be trusted."""


@dataclass(frozen=True)
class Imported:
    """A camera as another program's file has it.

    Parameters
    ----------
    camera : Camera, optional
        None where it is not exactly one of our lens models, or its image size is not known.
    image_size : (int, int), optional
        Width and height, where the file has them.
    project : callable, optional
        (N, 3) points in the camera's frame to (N, 2) pixels in our conventions, NaN where there is no image: for fits.
    obstacles : tuple of str
        The parameters in the way of an exact import, as ``k4 = 0.02 (a term in r^8 that opencv models do not have)``.
    notes : tuple of Problem
        What a person should know: ``unverified-convention``, ``not-a-result``.
    resize : callable, optional
        Makes the same import for an image size, (width, height), that the file does not have.
    """

    camera: Camera | None
    image_size: tuple[int, int] | None = None
    project: Callable[[Points], Pixels] | None = None
    obstacles: tuple[str, ...] = ()
    notes: tuple[Problem, ...] = ()
    resize: Callable[[tuple[int, int]], "Imported"] | None = None


@runtime_checkable
class CameraFormat(Provided, Protocol):
    """Reads another program's camera files, or writes them, or both.

    Attributes
    ----------
    title : str
        The program and its file, for people.
    extensions : tuple of str
        Such as ``(".yaml", ".yml")``.
    reads, writes : bool
    models : tuple of str
        Our lens models that it can carry exactly.
    """

    title: str
    extensions: tuple[str, ...]
    reads: bool
    writes: bool
    models: tuple[str, ...]

    def recognises(self, path: Path) -> bool:
        """Whether the file is one of these, by its content; cheap, never raises."""

    def read(self, path: Path) -> Mapping[str, Imported]:
        """The cameras in the file, by the file's own names for them; raises FileFormatError."""

    def write(self, cameras: Mapping[str, Camera], path: Path) -> None:
        """Write cameras; raises InputError where the format cannot carry one exactly."""


@runtime_checkable
class KeepsNotes(Protocol):
    """A `CameraFormat` whose files have room for a few lines beside a camera: how it was imported, how well it fits."""

    def write_with_notes(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> None:
        """Like `CameraFormat.write`, with notes for people by their subject."""


@runtime_checkable
class ImageSource(Provided, Protocol):
    """Delivers images: a camera, or a folder that another program fills.

    What it knows of an image, such as exposure and binning, goes into `Image.record`. What a person should know while
    it works goes to a logger below ``opencsp_calib``: what it has set in the camera, a cable that is pulled.
    """

    def devices(self) -> Sequence[str]:
        """What can be opened, by serial number or path."""

    def open(self, device: str, **settings: Any) -> AbstractContextManager[Iterator[Image]]:
        """The images of a device, as they come, until the context is left."""
