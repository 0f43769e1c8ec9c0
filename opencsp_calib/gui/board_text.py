"""The board that the fields describe, as `pipeline.board_from` takes it: in one line, or a file below DIR."""

from functools import lru_cache
from pathlib import Path

from opencsp_calib import pipeline
from opencsp_calib.errors import InputError
from opencsp_calib.gui.files import within
from opencsp_calib.gui.settings import FILE, Settings
from opencsp_calib.hdf5_reading import EXTENSIONS

__all__ = ["board_text"]


def board_text(settings: Settings, folder: Path) -> str:
    """The board's description, or the whole path of the file that it is in.

    Raises
    ------
    InputError
        If the fields describe none; the message says which field is wrong.
    """
    if settings.board_kind != FILE:
        settings.board()
        return settings.spec
    path = within(folder, settings.board_spec)
    if path.suffix.lower() not in (".json", *EXTENSIONS):
        raise InputError("name a board file (.json), or a camera file (.h5): its board is taken as it was solved")
    if not path.is_file():
        raise InputError(f"{path} does not exist")
    _check(path, path.stat().st_mtime_ns)
    return str(path)


@lru_cache(8)
def _check(path: Path, _: int) -> None:
    """Read a board's file once, and again when it has changed, instead of at each look at the page."""
    pipeline.board_from(str(path))
