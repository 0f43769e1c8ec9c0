"""Camera files of any format, as people handle them: open, convert exactly or by a fit, write, undistort with one."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from os import PathLike
from pathlib import Path

from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Problem
from opencsp_calib.errors import FileFormatError, InputError
from opencsp_calib.hdf5 import load_record
from opencsp_calib.hdf5_calibration import load_calibration
from opencsp_calib.images import ImageFile, read_image, write_image
from opencsp_calib.importing import exact, fitted, pick, read_cameras
from opencsp_calib.interfaces import Imported, KeepsNotes
from opencsp_calib.lens_fit import LensFit
from opencsp_calib.models import lens_model
from opencsp_calib.registry import installed

__all__ = [
    "CameraFile",
    "Converted",
    "calibration_in",
    "convert",
    "image_size_from",
    "read_camera_file",
    "typed_camera",
    "undistort_images",
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
    try:
        record = load_record(path)
    except FileFormatError:  # not one of ours: it has no record
        record = {}
    return CameraFile(Path(path), key, imported, calibration_in(path), record)


def calibration_in(path: str | PathLike[str]) -> Calibration | None:
    """The calibration in one of our camera files; None in any other."""
    try:
        return load_calibration(path)
    except FileFormatError:
        return None


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


def image_size_from(text: str | None) -> tuple[int, int] | None:
    """The width and height in WIDTHxHEIGHT.

    Raises
    ------
    InputError
        If it is written otherwise.
    """
    if text is None:
        return None
    width, x, height = text.lower().partition("x")
    if not (x and width.isdecimal() and height.isdecimal()):
        raise InputError(f"an image size is written as WIDTHxHEIGHT, such as 1626x1236, not {text!r}")
    return int(width), int(height)


def typed_camera(params: str, model: str | None, image_size: str | None, name: str) -> Camera:
    """A camera typed by hand: ``fx=..,fy=..,...`` for a lens model and an image size.

    Raises
    ------
    InputError
        If one of them is missing, or is none of the model's.
    """
    size = image_size_from(image_size)
    if model is None or size is None:
        raise InputError("--params needs --model and --image-size too")
    names = lens_model(model).parameter_names
    values = dict(_typed_number(pair) for pair in params.split(","))
    missing, unknown = [n for n in names if n not in values], [n for n in values if n not in names]
    if missing or unknown:
        what = f"lacks {', '.join(missing)}" if missing else f"has {', '.join(unknown)}, which it should not"
        raise InputError(f"--params {what}; {model} has {', '.join(names)}")
    return Camera(name, model, [values[n] for n in names], size)  # type: ignore[arg-type]  # made an array there


def write_camera_file(
    camera: Camera, path: Path, format_name: str | None = None, record: Mapping[str, str] | None = None
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


def undistort_images(
    camera: Camera, files: tuple[ImageFile, ...], folder: Path, progress: Callable[[int, int], None] | None = None
) -> None:
    """Write images without their lens distortion into another folder, as PNG.

    Parameters
    ----------
    camera : Camera
    files : tuple of ImageFile
    folder : Path
        Made if it does not exist.
    progress : callable, optional
        Told how many are done, and how many there are, after each.

    Raises
    ------
    InputError
        If the folder is a file, or holds the images themselves; or one cannot be read, or has another size.
    """
    if folder.exists() and not folder.is_dir():
        raise InputError(f"{folder} is a file; give a folder")
    if folder.absolute() in {file.path.absolute().parent for file in files}:
        raise InputError(f"{folder} holds the photographs themselves; give another folder")
    folder.mkdir(parents=True, exist_ok=True)
    for done, file in enumerate(files, start=1):
        target = folder / Path(file.name).with_suffix(".png")
        target.parent.mkdir(parents=True, exist_ok=True)
        write_image(camera.undistort(read_image(file).pixels), target)
        if progress:
            progress(done, len(files))


def _typed_number(pair: str) -> tuple[str, float]:
    name, _, value = pair.partition("=")
    try:
        return name.strip(), float(value)
    except ValueError:
        raise InputError(f"--params takes NAME=NUMBER, such as fx=2710.0, not {pair.strip()!r}") from None


def _noted(notes: tuple[Problem, ...]) -> dict[str, str]:
    """Notes by their code, all messages of one code together."""
    found: dict[str, str] = {}
    for note in notes:
        key = f"import {note.code}"
        found[key] = f"{found[key]}; {note.message}" if key in found else note.message
    return found
