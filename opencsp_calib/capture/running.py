"""From what a person asks for to a capture that runs: the same for the command line and the window."""

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from threadpoolctl import threadpool_limits

from opencsp_calib.capture.capture import Capture, State
from opencsp_calib.capture.folder import CaptureFolder
from opencsp_calib.capture.release import release_from
from opencsp_calib.coach import Knowledge
from opencsp_calib.counted import counted
from opencsp_calib.errors import InputError
from opencsp_calib.information import GOAL_PX
from opencsp_calib.interfaces import ImageSource
from opencsp_calib.looking import Search
from opencsp_calib.opencv import opencv_on_one_thread
from opencsp_calib.pipeline import board_from
from opencsp_calib.registry import installed

__all__ = ["Prepared", "prepared", "settings_from"]

Tell = Callable[[str], None]


@dataclass(frozen=True, eq=False)
class Prepared:
    """A capture, and where its images come from.

    Parameters
    ----------
    capture : Capture
    source : ImageSource
    device : str
    settings : mapping of str to str
        Of the device, in the order in which they are applied.
    """

    capture: Capture
    source: ImageSource
    device: str
    settings: Mapping[str, str]

    def run(self, show: Callable[[State], None], tell: Tell) -> Knowledge | None:
        """Open the device and go; see `Capture.run`.

        Parameters
        ----------
        show : callable
            Called with the state after every frame.
        tell : callable
            Called with what the source has to say, such as what it has set in the camera.

        Raises
        ------
        InputError
            With the photographs that are safe, where there are some.
        """
        try:
            # small matrices: threads would only get in each other's way
            with (
                threadpool_limits(1),
                opencv_on_one_thread(),
                _told(tell),
                self.source.open(self.device, **self.settings) as images,
            ):
                return self.capture.run(images, show)
        except InputError as error:
            taken = len(self.capture.folder.images)
            raise InputError(f"{error}; {self.safe}" if taken else str(error)) from None

    @property
    def safe(self) -> str:
        """What to say where it was stopped."""
        folder = self.capture.folder
        taken = len(folder.images)
        safe = counted(taken, "photograph is", "photographs are")
        return f"{safe} safe in {folder.path}, and the same capture goes on from there"


def prepared(
    folder: Path,
    board: str,
    *,
    source: str,
    device: str | None,
    release: str,
    count: int,
    settings: Mapping[str, str],
    range_m: float | None = None,
    goal_px: float = GOAL_PX,
    tell: Tell,
) -> Prepared:
    """A capture as asked for, ready to run; the arguments are those of the command ``capture``.

    Raises
    ------
    InputError
        If something asked for cannot be.
    """
    registry = installed()
    found, how, chosen = board_from(board), release_from(release), registry.image_source(source)
    detector = registry.detector_for(found)
    device = _device(chosen, device, folder, tell)
    photographs = CaptureFolder.opened(folder, found.spec, source, device)
    before = len(photographs.images)
    if before:
        tell(f"{folder} has {counted(before, 'photograph')} already: going on from there")
    search = Search(found, detector, "model" if detector.feature == "corner" else "none")
    capture = Capture(photographs, search, how, count, range_m=range_m, goal_px=goal_px)
    return Prepared(capture, chosen, device, settings)


def settings_from(pairs: list[str]) -> dict[str, str]:
    """What ``--set FEATURE=VALUE`` says, in order; of a feature set twice the last.

    Raises
    ------
    InputError
    """
    values: dict[str, str] = {}
    for pair in pairs:
        name, equals, value = pair.partition("=")
        if not (equals and name.strip()):
            raise InputError(f"--set takes FEATURE=VALUE, such as --set ExposureTime=5000, not {pair!r}")
        values.pop(name.strip(), None)
        values[name.strip()] = value.strip()
    return values


def _device(source: ImageSource, device: str | None, folder: Path, tell: Tell) -> str:
    """The device named; else the first there is."""
    if not device:
        there = list(source.devices())
        if len(there) > 1:
            tell(f"of {len(there)} cameras {there[0]} is taken; name another with --device: {', '.join(there[1:])}")
        return there[0] if there else ""
    if Path(device).exists() and folder.exists() and Path(device).samefile(folder):
        raise InputError(f"images cannot be taken from {device} into the same folder; name another DIR")
    return device


@contextmanager
def _told(tell: Tell) -> Iterator[None]:
    """Have the messages of our loggers, which are sources', told."""
    logger = logging.getLogger("opencsp_calib")
    handler, level = _Teller(tell), logger.level
    logger.addHandler(handler)
    logger.setLevel(logging.INFO)
    try:
        yield
    finally:
        logger.removeHandler(handler)
        logger.setLevel(level)


class _Teller(logging.Handler):
    def __init__(self, tell: Tell) -> None:
        super().__init__()
        self._tell = tell

    def emit(self, record: logging.LogRecord) -> None:
        """Pass a message on."""
        self._tell(record.getMessage())
