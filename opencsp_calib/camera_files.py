"""Camera files of any format, as people handle them: open, convert exactly or by a fit, write."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path

from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Problem
from opencsp_calib.errors import InputError
from opencsp_calib.hdf5 import load_record
from opencsp_calib.hdf5_calibration import load_calibration
from opencsp_calib.hdf5_reading import opened
from opencsp_calib.importing import exact, fitted, pick, read_cameras
from opencsp_calib.interfaces import Imported, KeepsNotes
from opencsp_calib.lens_fit import LensFit
from opencsp_calib.registry import installed
from opencsp_calib.typed import image_size_from

__all__ = [
    "CameraFile",
    "Converted",
    "convert",
    "read_camera_file",
    "write_camera_file",
]


@dataclass(frozen=True, eq=False)
class CameraFile:
    """One camera of a file, with whatever else the file tells of it.

    Parameters
    ----------
    path : Path
    name : str
        The file's own name for the camera.
    imported : Imported
    calibration : Calibration or None
        How it was calibrated, where it is one of our files that has that.
    record : mapping of str to str
        The notes kept with it.
    """

    path: Path
    name: str
    imported: Imported
    calibration: Calibration | None = field(repr=False)
    record: Mapping[str, str]

    @property
    def camera(self) -> Camera:
        """The camera; raises NotExactError where it is not exactly one of our lens models."""
        with _naming(self.path):
            return exact(self.imported)


@dataclass(frozen=True)
class Converted:
    """A camera to be written to another file.

    Parameters
    ----------
    camera : Camera
    record : mapping of str to str
        What is to be known about how it was converted.
    fit : LensFit or None
        None where it is exact.
    """

    camera: Camera
    record: Mapping[str, str]
    fit: LensFit | None = None


def read_camera_file(
    path: str | PathLike[str],
    name: str | None = None,
    format_name: str | None = None,
    image_size: str | None = None,
    *,
    where_several: bool = False,
) -> CameraFile:
    """One camera of a file of any format we read.

    Parameters
    ----------
    path : path-like
    name : str, optional
        Of the camera, where the file has several.
    format_name : str, optional
        Where the format cannot be told.
    image_size : str, optional
        WIDTHxHEIGHT, where the file does not have it.
    where_several : bool
        Whether the name is only meant where the file has several cameras.

    Raises
    ------
    InputError
        As `importing.read_cameras` and `importing.pick`.
    """
    cameras = read_cameras(path, installed().camera_formats, image_size_from(image_size), format_name)
    with _naming(path):
        key, imported = pick(cameras, None if where_several and len(cameras) == 1 else name)
    return CameraFile(Path(path), key, imported, *_kept_with(path))


def _kept_with(path: str | PathLike[str]) -> tuple[Calibration | None, Mapping[str, str]]:
    """The calibration and the notes in a camera file of ours; nothing in any other."""
    import h5py

    if not h5py.is_hdf5(path):
        return None, {}
    with opened(path) as file:
        solved = "Calibration/poses" in file
    return load_calibration(path) if solved else None, load_record(path)


def convert(
    file: CameraFile, fit: str | None = None, accept_error_px: float | None = None, name: str | None = None
) -> Converted:
    """The camera of a file as one of our lens models: exactly, or by a fit.

    Parameters
    ----------
    file : CameraFile
    fit : str, optional
        The lens model to approximate it by.
    accept_error_px : float, optional
        See `importing.fitted`.
    name : str, optional
        Of the new camera.

    Raises
    ------
    NotExactError
        If it is not exactly one, and no fit was asked for or none is good enough.
    """
    record = {**file.record, **_noted(file.imported.notes)}
    if fit is None:
        camera = file.camera
        return Converted(replace(camera, name=name) if name else camera, record)
    accepted = {} if accept_error_px is None else {"accept_error_px": accept_error_px}
    with _naming(file.path):
        found = fitted(file.imported, fit, name=name or file.name, **accepted)
    record["import fit"] = f"{fit}, {found}"
    return Converted(found.camera, record, found)


@contextmanager
def _naming(path: str | PathLike[str]) -> Iterator[None]:
    """Have what goes wrong tell with which file: a command may read several."""
    try:
        yield
    except InputError as error:
        raise type(error)(f"{path}: {error}") from None


def write_camera_file(
    camera: Camera,
    path: str | PathLike[str],
    format_name: str | None = None,
    record: Mapping[str, str] | None = None,
) -> str:
    """Write a camera in the format named, or that its extension means, with the record where there is room for it.

    Returns
    -------
    str
        A warning, where there is a record and no room for it; else empty.

    Raises
    ------
    InputError
        If the format cannot be told, does not exist or cannot carry the camera, or the file cannot be written.
    """
    path = Path(path)
    writers = {name: f for name, f in installed().camera_formats.items() if f.writes}
    if format_name is not None and format_name not in writers:
        raise InputError(
            f"no format that can be written is called {format_name!r}; there are {', '.join(sorted(writers))}"
        )
    if format_name is None:
        fitting = [name for name, f in sorted(writers.items()) if path.suffix.lower() in f.extensions]
        if len(fitting) != 1:
            choice = ", ".join(fitting or sorted(writers))
            raise InputError(f"which format {path.name} should have cannot be told; add --to with one of {choice}")
        format_name = fitting[0]
    writer = writers[format_name]
    if record and isinstance(writer, KeepsNotes):
        writer.write_with_notes({camera.name: camera}, path, record)
        return ""
    writer.write({camera.name: camera}, path)
    return f"{writer.title} has no room for notes; keep them yourself" if record else ""


def _noted(notes: tuple[Problem, ...]) -> dict[str, str]:
    """Notes by their code, all messages of one code together."""
    found: dict[str, str] = {}
    for note in notes:
        key = f"import {note.code}"
        found[key] = f"{found[key]}; {note.message}" if key in found else note.message
    return found
