"""Writing a printable board to a file."""

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from opencsp_calib.atomic import check_writable, replacing
from opencsp_calib.board import Board
from opencsp_calib.drawing.page import Page, page_of
from opencsp_calib.drawing.pdf import write_pdf
from opencsp_calib.drawing.png import write_png
from opencsp_calib.drawing.shapes import Drawing
from opencsp_calib.drawing.svg import write_svg
from opencsp_calib.errors import InputError

__all__ = ["write_board"]

WRITERS: Mapping[str, Callable[[Page, Path], None]] = MappingProxyType(
    {".svg": write_svg, ".pdf": write_pdf, ".png": write_png}
)


def write_board(board: Board, drawing: Drawing, path: str | os.PathLike[str]) -> None:
    """Write a page with the board at true size, a margin of one square, a bar to measure and the board's description.

    Parameters
    ----------
    board : Board
    drawing : Drawing
        Of that board, by `BoardKind.draw`.
    path : path-like
        Ends in ``.svg``, ``.pdf`` or ``.png`` (300 dots an inch).

    Raises
    ------
    InputError
        If the extension is another, the page too large for its format, or the file cannot be written.
    """
    path = Path(path)
    writer = WRITERS.get(path.suffix.lower())
    if writer is None:
        raise InputError(f"a board is drawn as .svg, .pdf or .png, not as {path.name}")
    check_writable(path)
    page = page_of(board, drawing)
    with replacing(path) as temporary:
        writer(page, temporary)
