"""Which files the window may touch: those below the folder it was started for, links and ``..`` resolved."""

import re
from collections.abc import Sequence
from pathlib import Path

from opencsp_calib.errors import InputError
from opencsp_calib.images import ImageFile, find_images

__all__ = ["file_name", "images_in", "shown", "with_ending", "within"]


def within(folder: Path, text: str) -> Path:
    """The path that a person typed, relative to the folder or whole.

    Raises
    ------
    InputError
        If it is not below the folder.
    """
    root = folder.resolve()
    try:
        path = (root / Path(text.strip()).expanduser()).resolve()
    except (OSError, ValueError, RuntimeError):
        raise InputError(f"{text!r} is not a path") from None
    if not path.is_relative_to(root):
        raise InputError(f"{text} is outside of {root}; only files below it are used: start the window for another")
    return path


def images_in(folder: Path, texts: list[str]) -> tuple[ImageFile, ...]:
    """The photographs that files and folders below the folder name, in order.

    Raises
    ------
    InputError
        If one is outside, or there are none.
    """
    files = find_images([within(folder, text) for text in texts])
    for file in files:
        within(folder, str(file.path))  # a link in the folder may lead out of it
    return files


def file_name(text: str, fallback: str) -> str:
    """A name of a file that any system can have, from what a person or a browser calls it."""
    last = re.split(r"[/\\]", text)[-1]
    name = re.sub(r'[\x00-\x1f<>:"|?*]', "_", last).strip(" .")[:120]
    return name or fallback


def with_ending(name: str, endings: Sequence[str]) -> str:
    """A file's name that ends as its kind of file does: with the first of these endings, where it has none of them."""
    ends = not endings or name.lower().endswith(tuple(endings))
    return name if ends else str(Path(name)) + endings[0]


def shown(folder: Path, path: Path) -> str:
    """A path as people read it: relative to the folder, where it is below."""
    root = folder.resolve()
    return path.relative_to(root).as_posix() if path.is_relative_to(root) else str(path)
