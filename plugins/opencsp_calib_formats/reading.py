"""What all formats of this plugin share: nothing to install, and errors that name the file."""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from opencsp_calib import Camera, InputError, Problem
from opencsp_calib.atomic import replacing
from opencsp_calib.errors import FileFormatError
from opencsp_calib.interfaces import Imported

__all__ = ["FileFormat", "TextFormat", "comments", "decimal", "naming", "not_a_result", "only_one"]
__all__ += ["printable", "unverified", "xml_comments"]

UNPRINTABLE = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")


class FileFormat(ABC):
    """The part of a `CameraFormat` that does not differ: formats that need no vendor, read only unless they say so."""

    name: str
    title: str
    extensions: tuple[str, ...]
    models: tuple[str, ...]
    fitted: tuple[str, ...] = ()
    """What the program has that none of our models is: read for ``--fit`` only."""
    reads = True
    writes = False

    def missing(self) -> str | None:
        """Nothing ever is."""
        return None

    @abstractmethod
    def recognises(self, path: Path) -> bool:
        """See `CameraFormat.recognises`."""

    @abstractmethod
    def read(self, path: Path) -> Mapping[str, Imported]:
        """See `CameraFormat.read`."""

    def write(self, cameras: Mapping[str, Camera], path: Path) -> None:
        """See `CameraFormat.write`."""
        raise InputError(f"{path} cannot be written: {self.title} is only read")


class TextFormat(FileFormat):
    """A format that is written as text, with room for notes."""

    writes = True

    @abstractmethod
    def text(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> str:
        """What the file will hold; raises InputError where the format cannot carry a camera exactly."""

    def write(self, cameras: Mapping[str, Camera], path: Path) -> None:
        """See `CameraFormat.write`."""
        self.write_with_notes(cameras, path, {})

    def write_with_notes(self, cameras: Mapping[str, Camera], path: Path, notes: Mapping[str, str]) -> None:
        """See `KeepsNotes.write_with_notes`."""
        text = self.text(cameras, path, notes)
        with replacing(path) as temporary:
            temporary.write_text(text, encoding="utf-8", errors="replace")  # half a character, of a file's name


def comments(notes: Mapping[str, str]) -> list[str]:
    """Notes as the lines of a comment, of plain characters, as in YAML, ini and Python."""
    lines = (" ".join(f"# {subject}: {note}".split()) for subject, note in notes.items())
    return [printable(line).encode("ascii", "backslashreplace").decode("ascii") for line in lines]


def printable(text: str) -> str:
    """A text without control characters, which YAML and XML do not hold: each as Python writes it."""
    return UNPRINTABLE.sub(lambda found: found[0].encode("unicode_escape").decode("ascii"), text)


def xml_comments(notes: Mapping[str, str]) -> list[str]:
    """Notes as comments of XML, within which there must be no double hyphen."""
    return [f"<!--{line[1:].replace('--', '- -')} -->" for line in comments(notes)]


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the file's name before every complaint about its content, and make it a FileFormatError."""
    try:
        yield
    except InputError as error:
        message = " ".join(str(error).split())  # parsers' messages have several lines
        raise FileFormatError(message if str(path) in message else f"{path}: {message}") from error


def unverified(message: str) -> Problem:
    """The note on a convention that could not be verified; the message names the possible shift."""
    return Problem("unverified-convention", message)


def not_a_result(message: str) -> Problem:
    """The note on numbers that are an initial guess and no calibration."""
    return Problem("not-a-result", message)


def decimal(value: float) -> str:
    """A number in full precision, as every YAML, JSON and ini reader takes for one: ``1.0e-05``, not ``1e-05``."""
    text = repr(float(value))
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}.0{e}{exponent}" if e and "." not in mantissa else text


def only_one(cameras: Mapping[str, Camera], path: Path, title: str) -> Camera:
    """The camera, if there is one only; InputError otherwise."""
    if len(cameras) != 1:
        raise InputError(f"cannot write {path}: {title} holds one camera, not {len(cameras)}; choose one with --camera")
    return next(iter(cameras.values()))
