"""Reading cameras from any file that a plugin understands: which format, which camera, exact or fitted.

::

    formats = installed().camera_formats
    cameras = read_cameras("cameras.txt", formats)          # names -> Imported
    name, imported = pick(cameras, "1")
    camera = exact(imported)                                 # or raises NotExactError, which names what is in the way
    camera = fitted(imported, "opencv8").camera              # or approximates, within 0.1 px or what was accepted
"""

import stat
import warnings
from collections.abc import Callable, Mapping
from os import PathLike
from pathlib import Path

import numpy as np

from opencsp_calib.arrays import Params, Pixels, Points
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Problem
from opencsp_calib.errors import FileFormatError, InputError, MissingDependencyError, NotExactError, PluginWarning
from opencsp_calib.hdf5 import load_camera
from opencsp_calib.hdf5_reading import like_hdf5
from opencsp_calib.interfaces import CameraFormat, Imported
from opencsp_calib.lens_fit import LensFit, fit
from opencsp_calib.models import LENS_MODELS

__all__ = ["as_imported", "exact", "fitted", "not_exactly", "pick", "read_cameras", "recognise"]

NO_SIZE = "the file does not have the image size; add --image-size WIDTHxHEIGHT"
MAX_LISTED = 20  # cameras in a message
ACCEPTED_PX = 0.1  # worst error of a fit that nobody need be asked about


def as_imported(
    name: str, model: str, params: Params, image_size: tuple[int, int] | None, notes: tuple[Problem, ...] = ()
) -> Imported:
    """What a reader returns for a camera that is exactly one of ours.

    Parameters
    ----------
    name, model, params
        As for `Camera`.
    image_size : (int, int) or None
        None where the file does not have it: whoever imports is asked for it.
    notes : tuple of Problem

    Raises
    ------
    InputError
        If the parameters are not a camera's.
    """
    camera = Camera(name, model, params, image_size or (1, 1))
    if image_size is not None:
        return Imported(camera, camera.image_size, camera.project, notes=notes)
    return Imported(
        None, None, camera.project, notes=notes, resize=lambda size: as_imported(name, model, params, size, notes)
    )


def not_exactly(
    obstacles: tuple[str, ...],
    project: Callable[[Points], Pixels] | None,
    image_size: tuple[int, int] | None,
    notes: tuple[Problem, ...] = (),
) -> Imported:
    """What a reader returns for a camera that is none of ours: the obstacles, and the projection to fit to.

    Parameters
    ----------
    obstacles, project, image_size, notes
        As for `Imported`; the projection must not depend on the image size where that is None.
    """

    def resize(size: tuple[int, int]) -> Imported:
        return Imported(None, size, project, obstacles, notes)

    return Imported(None, image_size, project, obstacles, notes, resize if image_size is None else None)


def recognise(path: str | PathLike[str], formats: Mapping[str, CameraFormat], name: str | None = None) -> CameraFormat:
    """The format of a file, by its content.

    Parameters
    ----------
    path : path-like
    formats : mapping of str to CameraFormat
        Those to choose from: ``installed().camera_formats``.
    name : str, optional
        What the user says it is; then its content is not asked.

    Raises
    ------
    InputError
        If there is no such file, it cannot be read, or the user named no format that reads.
    FileFormatError
        If no format, or more than one, recognises the file: the message lists them; or it is HDF5 and damaged.
    MissingDependencyError
        If the format cannot be read here.
    """
    path = Path(path)
    _check_readable(path)
    readable = {key: format_ for key, format_ in formats.items() if format_.reads}
    if name is not None and name not in readable:
        raise InputError(f"no readable format is called {name!r}; there are {', '.join(sorted(readable))}")
    found = [readable[name]] if name is not None else [f for f in readable.values() if _recognised(f, path)]
    if not found and like_hdf5(path):
        load_camera(path)  # of our own format, the reader says what is wrong
    if not found:
        raise FileFormatError(
            f"{path} is no camera file of a format we know; `opencsp-calib formats` lists them, --from names one"
        )
    if len(found) > 1:
        names = " or ".join(sorted(format_.name for format_ in found))
        raise FileFormatError(f"{path} may be {names}; say which with --from")
    missing = found[0].missing()
    if missing:
        raise MissingDependencyError(f"{path} ({found[0].title}) cannot be read here: {missing}")
    return found[0]


def _check_readable(path: Path) -> None:
    try:
        mode = path.stat().st_mode
        if stat.S_ISREG(mode):
            path.open("rb").close()
    except FileNotFoundError:
        raise InputError(f"{path} does not exist") from None
    except (OSError, ValueError) as error:  # no permission, a name too long, a circle of links, a null in the name
        raise InputError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if stat.S_ISDIR(mode):
        raise InputError(f"{path} is a folder; name the camera file in it")
    if not stat.S_ISREG(mode):
        raise InputError(f"{path} is not a regular file")


def _recognised(format_: CameraFormat, path: Path) -> bool:
    try:
        return format_.recognises(path)
    except Exception as error:  # a stranger's code: whatever it does must not keep others from reading the file
        message = f"the camera format {format_.name!r} cannot tell whether {path} is its own: {error!r}"
        warnings.warn(message, PluginWarning, stacklevel=4)
        return False


def read_cameras(
    path: str | PathLike[str],
    formats: Mapping[str, CameraFormat],
    image_size: tuple[int, int] | None = None,
    name: str | None = None,
) -> Mapping[str, Imported]:
    """All cameras of a file, by the file's own names for them.

    Parameters
    ----------
    path, formats, name
        As for `recognise`.
    image_size : (int, int), optional
        Width and height, for a file that does not have them.

    Raises
    ------
    InputError
        As `recognise`; or if the file has another image size.
    FileFormatError
        If the file cannot be read, or holds no camera.
    """
    format_ = recognise(path, formats, name)
    cameras = format_.read(Path(path))
    if not cameras:
        raise FileFormatError(f"{path} ({format_.title}) holds no camera")
    if image_size is None:
        return cameras
    return {key: _sized(imported, image_size, f"{path}, camera {key!r}") for key, imported in cameras.items()}


def _sized(imported: Imported, size: tuple[int, int], what: str) -> Imported:
    if imported.image_size is None:
        return imported.resize(size) if imported.resize is not None else imported
    if tuple(imported.image_size) != tuple(size):
        has, given = ("x".join(map(str, s)) for s in (imported.image_size, size))
        raise InputError(f"{what}: its images have {has} pixels, not {given}; leave out --image-size")
    return imported


def pick(cameras: Mapping[str, Imported], name: str | None = None) -> tuple[str, Imported]:
    """One camera of a file, and its name there.

    Parameters
    ----------
    cameras : mapping of str to Imported
    name : str, optional
        May be left out where there is only one.

    Raises
    ------
    InputError
        If there is none of that name, or none was named and there are several; the message lists them.
    """
    listed = ", ".join(_quoted(key) for key in list(cameras)[:MAX_LISTED])
    listed += f" ... ({len(cameras)} in all)" if len(cameras) > MAX_LISTED else ""
    if name is not None:
        if name not in cameras:
            raise InputError(f"no camera is called {name!r} in the file; it has {listed}")
        return name, cameras[name]
    if len(cameras) != 1:
        notes = dict.fromkeys(n.message for i in cameras.values() for n in i.notes if n.code == "ambiguous-model")
        why = "; ".join(["", *notes])
        raise InputError(f"the file has {len(cameras)} cameras; choose one with --camera: {listed}{why}")
    return next(iter(cameras.items()))


def _quoted(name: str) -> str:
    """A camera's name for a list: in quotes where one could not tell where it ends."""
    return f'"{name}"' if "," in name or name.strip() != name else name


def exact(imported: Imported) -> Camera:
    """The camera, where it is exactly one of our lens models.

    Raises
    ------
    NotExactError
        If it is none; the message names what is in the way.
    InputError
        If the image size is not known.
    """
    if imported.obstacles:
        reason = f"not exactly one of our lens models: {'; '.join(imported.obstacles)}"
        if imported.project is None and imported.resize is None:
            raise NotExactError(f"{reason}; and it cannot be fitted")
        models = ", ".join(LENS_MODELS)
        raise NotExactError(f"{reason}; --fit MODEL of convert approximates it and states the error ({models})")
    if imported.camera is None:
        raise InputError(NO_SIZE)
    return imported.camera


def fitted(
    imported: Imported, model: str, accept_error_px: float = ACCEPTED_PX, *, name: str = "", max_angle: float = np.pi
) -> LensFit:
    """One of our lens models fitted to an imported camera, over its image.

    Parameters
    ----------
    imported : Imported
    model : str
        The lens model's name.
    accept_error_px : float
        The worst error, anywhere in the image, that is accepted.
    name : str
        The camera's.
    max_angle : float
        As for `lens_fit.fit`, radians.

    Raises
    ------
    NotExactError
        If nothing is known to fit to, or the worst error is larger than accepted.
    InputError
        If the image size is not known, or the model cannot show what the image does.
    """
    if imported.project is None and imported.resize is None:
        raise NotExactError(f"cannot be fitted: {'; '.join(imported.obstacles) or 'its projection is not known'}")
    if imported.image_size is None or imported.project is None:
        raise InputError(NO_SIZE)
    found = fit(imported.project, imported.image_size, model, name=name, max_angle=max_angle)
    if not found.worst_px <= accept_error_px:
        raise NotExactError(
            f"{model} does not fit: rms {found.rms_px:.2g} px, worst {found.worst_px:.2g} px over the image; "
            f"fit another model, or accept it with --accept-error {found.worst_px * 1.05:.2g}"
        )
    return found
