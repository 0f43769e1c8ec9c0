"""What all formats of this plugin share: nothing to install, and errors that name the file."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from opencsp_calib import Camera, InputError, Problem
from opencsp_calib.errors import FileFormatError

__all__ = ["FileFormat", "naming", "not_a_result", "unverified"]


class FileFormat:
    """The part of a `CameraFormat` that does not differ: formats that need no vendor, read only unless they say so."""

    title: str
    reads = True
    writes = False

    def missing(self) -> str | None:
        """Nothing ever is."""
        return None

    def write(self, cameras: Mapping[str, Camera], path: Path) -> None:
        """See `CameraFormat.write`."""
        raise InputError(f"{path} cannot be written: {self.title} is only read")


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the file's name before every complaint about its content, and make it a FileFormatError."""
    try:
        yield
    except InputError as error:
        message = str(error)
        raise FileFormatError(message if str(path) in message else f"{path}: {message}") from error


def unverified(message: str) -> Problem:
    """The note on a convention that could not be verified; the message names the possible shift."""
    return Problem("unverified-convention", message)


def not_a_result(message: str) -> Problem:
    """The note on numbers that are an initial guess and no calibration."""
    return Problem("not-a-result", message)
