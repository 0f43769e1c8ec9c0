"""A board to print at true size: what it looks like, and as PDF, SVG or PNG."""

import asyncio
import base64
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING
from urllib.parse import quote

from nicegui import ui

from opencsp_calib.board import Board
from opencsp_calib.drawing import Drawing, write_board
from opencsp_calib.errors import CalibError
from opencsp_calib.gui.asking import may_write
from opencsp_calib.gui.controls import action, choice, field, set_prop
from opencsp_calib.gui.drawn import drawn
from opencsp_calib.gui.files import shown, with_ending, within
from opencsp_calib.gui.session import Session
from opencsp_calib.gui.settings import FILE
from opencsp_calib.registry import installed

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

EXAMPLE = "checkerboard:18x23:50mm"
KINDS = {".pdf": "PDF", ".svg": "SVG", ".png": "PNG, 300 dots an inch"}


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session

    async def save() -> None:
        endings = sorted(KINDS, key=lambda ending: ending != suffix.value)  # the one that is chosen first
        try:
            path = within(session.folder, with_ending(place.value.strip() or "board", endings))
            await _save(session, installed().board(spec.value.strip()), path)
        except CalibError as error:
            session.say(str(error), "bad")

    with ui.element("div").classes("two"):
        with ui.element("div").classes("narrow"):
            ui.html("<h2>Print a board</h2>", sanitize=False)
            started = session.settings.spec if session.board and session.settings.board_kind != FILE else EXAMPLE
            spec = field("Description of the board", started, lambda _: refresh(), "board-spec")
            for kind in installed().boards.values():
                ui.label(kind.grammar).classes("hint")
            said = ui.label().classes("hint")
            suffix = choice("As", KINDS, ".pdf", lambda _: refresh())
            place = field("Save as", "", lambda _: None, hint="board.pdf")
            button = action("Save Board", save, "save-board")
        picture = drawn(lambda: None if said.text else spec.value.strip(), lambda: _picture(spec.value.strip()))

    def refresh() -> None:
        set_prop(place, "placeholder", f"board{suffix.value}")
        said.set_text(_wrong(spec.value.strip()))
        button.set_enabled(not said.text)
        picture()

    return refresh


def _wrong(spec: str) -> str:
    try:
        installed().board(spec)
    except CalibError as error:
        return str(error)
    return ""


async def _save(session: Session, board: Board, path: Path) -> None:
    if not await may_write(path):
        return
    await asyncio.to_thread(write_board, board, _drawing(board), path)
    place = shown(session.folder, path)
    session.say(f"Board saved: {place}. Print it at 100 %, and measure its bar.", "good")
    ui.download.from_url(f"/files?path={quote(place)}")


def _drawing(board: Board) -> Drawing:
    return installed().boards[board.kind].draw(board)


def _picture(spec: str) -> str:
    """The board as it will be printed, as an element of the page."""
    board = installed().board(spec)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "board.svg"
        write_board(board, _drawing(board), path)
        source = f"data:image/svg+xml;base64,{base64.b64encode(path.read_bytes()).decode()}"
    return f'<img class="board-picture" alt="The board as it will be printed" src="{source}">'
