"""Which cameras a fleet has: from a folder of folders, or from a file ``fleet.yaml``.

::

    board: checkerboard:18x23:50mm     # outside of cameras: for all of them, unless one says otherwise
    model: opencv8
    cameras:
      north:                           # photographs in the folder north/ beside this file
      south:
        images: [set1/*.png, set2/]    # in or below the folder of this file
        select: 60
        note: {lens: 25 mm}

The settings are spelled as the options of ``calibrate``. Without ``cameras``, every folder beside the file with
photographs in it is one.
"""

import difflib
import reprlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any, TypeAlias

import yaml

from opencsp_calib.calibration import LEAST_VIEWS
from opencsp_calib.errors import FileFormatError, InputError
from opencsp_calib.images import images_in, natural_order

__all__ = ["FILE_NAME", "FleetCamera", "find_fleet"]

FILE_NAME = "fleet.yaml"
MAX_BYTES = 2**20

Setting: TypeAlias = "tuple[str, Callable[[Any], bool]]"


@dataclass(frozen=True)
class FleetCamera:
    """One camera of a fleet: what to calibrate it from, and how.

    Parameters
    ----------
    name : str
        Also of the folder for its results.
    root : Path
        Where relative names in `settings` start.
    images : tuple of str
        Files, folders or glob patterns.
    settings : mapping
        By the names of `SETTINGS`.
    """

    name: str
    root: Path
    images: tuple[str, ...]
    settings: Mapping[str, Any] = field(default_factory=dict)


def _is_text(value: Any) -> bool:
    return isinstance(value, str) and bool(value.strip())


def _is_texts(value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(map(_is_text, value))


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < float("inf")


def _is_notes(value: Any) -> bool:
    return isinstance(value, dict) and all(isinstance(one, str | int | float) for one in (*value, *value.values()))


def _one_of(*words: str) -> Setting:
    return f"one of {', '.join(words)}", lambda value: value in words


TEXT: Setting = ("a text", _is_text)
SETTINGS: Mapping[str, Setting] = {
    "board": TEXT,
    "images": ("a file, folder or pattern, or a list of them", lambda value: _is_text(value) or _is_texts(value)),
    "detector": TEXT,
    "refine": _one_of("none", "subpix", "model"),
    "model": TEXT,
    "solver": TEXT,
    "board-shape": _one_of("flat", "warp", "free", "auto"),
    "pixel-aspect": ("free, square or a number", lambda value: value in ("free", "square") or _is_number(value)),
    "weights": _one_of("equal", "covariance"),
    "robust": ("yes or no", lambda value: isinstance(value, bool)),
    "exclude": ("a list of images' names", _is_texts),
    "select": (f"a whole number, at least {LEAST_VIEWS}", lambda value: type(value) is int and value >= LEAST_VIEWS),
    "pixel-pitch": ("a number of micrometres", _is_number),
    "note": ("pairs such as {lens: 25 mm}", _is_notes),
}
"""Each setting's name, what it must be, and whether a value is that."""


def find_fleet(path: Path, given: Mapping[str, Any]) -> tuple[FleetCamera, ...]:
    """The cameras of a folder, or of a file.

    Parameters
    ----------
    path : Path
        A folder with a folder of photographs for each camera, maybe with a `FILE_NAME` in it; or such a file.
    given : mapping
        Settings that take the place of those that the file has for all cameras.

    Raises
    ------
    InputError
        If there is no such folder or file, or no camera; FileFormatError, with the line, if the file is wrong.
    """
    file = path / FILE_NAME if path.is_dir() else path
    if not file.is_file():
        if not path.is_dir():
            raise InputError(f"no such folder or file: {path}")
        return _folders(path, given)
    loader, root = _parsed(file)
    common, cameras = {}, None
    for key, value, where in _entries(root, file):
        if key == "cameras":
            cameras = value
        else:
            common[key] = _checked(key, _value(value, loader, where), where)
    common |= given
    if cameras is None:
        return _folders(file.parent, common)
    return tuple(
        _camera(name, value, where, common, loader, file) for name, value, where in _entries(cameras, file)
    ) or _none(file)


def _camera(
    name: str, node: yaml.Node, where: str, common: Mapping[str, Any], loader: yaml.SafeLoader, file: Path
) -> FleetCamera:
    if PurePath(name).name != name or name in (".", "..") or set(name) & set('/\\:*?"<>|\0'):
        raise FileFormatError(f"{where}: a camera cannot be called {name!r}, since its folder cannot")
    own = {}
    if _value(node, loader, where) is not None:
        for key, value, place in _entries(node, file):
            own[key] = _checked(key, _value(value, loader, place), place)
    settings = {**common, **own}
    images = settings.pop("images", name)
    return FleetCamera(name, file.parent, tuple([images] if isinstance(images, str) else images), settings)


def _folders(folder: Path, settings: Mapping[str, Any]) -> tuple[FleetCamera, ...]:
    if "images" in settings:
        raise InputError(f"{folder}: images can be given for one camera only, below cameras")
    found = sorted((one for one in folder.iterdir() if one.is_dir() and _has_photographs(one)), key=natural_order)
    return tuple(FleetCamera(one.name, folder, (one.name,), settings) for one in found) or _none(folder)


def _has_photographs(folder: Path) -> bool:
    try:
        return bool(images_in(folder))
    except OSError:  # then its camera fails, and says why
        return True


def _none(where: Path) -> tuple[FleetCamera, ...]:
    raise InputError(f"{where} has no cameras: a fleet is a folder with a folder of photographs for each")


def _parsed(file: Path) -> tuple[yaml.SafeLoader, yaml.Node]:
    try:
        if file.stat().st_size > MAX_BYTES:
            raise FileFormatError(f"{file} is too large to be the description of a fleet")
        loader = yaml.SafeLoader(file.read_text(encoding="utf-8-sig"))
        root = loader.get_single_node()
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}") from None
    except yaml.MarkedYAMLError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        raise FileFormatError(f"{file}:{line}: this is not YAML: {error.problem}") from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise FileFormatError(f"{file}: this is not YAML: {str(error).splitlines()[0]}") from None
    if root is None:
        raise FileFormatError(f"{file} is empty")
    return loader, root


def _entries(node: yaml.Node, file: Path) -> Iterator[tuple[str, yaml.Node, str]]:
    """The key, the value and the place of each entry of a mapping."""
    where = f"{file}:{node.start_mark.line + 1}"
    if not isinstance(node, yaml.MappingNode):
        raise FileFormatError(f"{where}: here must be lines of the form name: value")
    seen = set()
    for key, value in node.value:
        where = f"{file}:{key.start_mark.line + 1}"
        if not isinstance(key, yaml.ScalarNode) or not key.value:
            raise FileFormatError(f"{where}: a name must be a word")
        if key.value in seen:
            raise FileFormatError(f"{where}: {key.value!r} is there twice")
        seen.add(key.value)
        yield key.value, value, where


def _value(node: yaml.Node, loader: yaml.SafeLoader, where: str) -> Any:
    try:
        return loader.construct_object(node, deep=True)
    except (yaml.YAMLError, ValueError) as error:  # an unknown tag; a date that is none
        raise FileFormatError(f"{where}: this cannot be read: {' '.join(str(error).split())[:120]}") from None


def _checked(key: str, value: Any, where: str) -> Any:
    if key not in SETTINGS:
        near = difflib.get_close_matches(key, [*SETTINGS, "cameras"], 1)
        meant = f"; is {near[0]!r} meant?" if near else f"; there are {', '.join(SETTINGS)}"
        raise FileFormatError(f"{where}: there is no setting {key!r}{meant}")
    wanted, fits = SETTINGS[key]
    if not fits(value):
        raise FileFormatError(f"{where}: {key!r} must be {wanted}, not {reprlib.repr(value)[:80]}")
    return value
