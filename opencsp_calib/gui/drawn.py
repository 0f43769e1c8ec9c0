"""What takes a while to draw on the page: made aside, when it is first looked at, once for each result."""

import asyncio
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from html import escape
from typing import TYPE_CHECKING, Any

from nicegui import background_tasks, ui

from opencsp_calib.errors import CalibError

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["DRAWING", "drawn", "of_calibration"]

DRAWING = ThreadPoolExecutor(1, thread_name_prefix="drawing")
"""One at a time, because matplotlib's settings are global."""


def drawn(key: Callable[[], Any], make: Callable[[], str]) -> Callable[[], None]:
    """An element with HTML that is made in another thread whenever its key is a new one, and empty where it is None.

    Returns
    -------
    callable
        Brings it up to date.
    """
    element = ui.html("", sanitize=False).classes("report")  # ours, and escaped where it is made
    shown: list[Any] = [None]

    def made(wanted: Any) -> str:
        return make() if shown[0] == wanted else ""  # nobody waits for it any more

    async def draw(wanted: Any) -> None:
        try:
            content = await asyncio.get_running_loop().run_in_executor(DRAWING, made, wanted)
        except CalibError as error:
            content = f'<p class="quiet">This cannot be drawn: {escape(str(error))}</p>'
        if shown[0] == wanted and not element.is_deleted:
            element.set_content(content)

    def refresh() -> None:
        wanted = key()
        if wanted == shown[0]:
            return
        shown[0] = wanted
        element.set_content("" if wanted is None else '<p class="quiet">Drawing …</p>')
        if wanted is not None:
            background_tasks.create(draw(wanted))

    return refresh


def of_calibration(page: "Page", make: Callable[..., str]) -> Callable[[], None]:
    """The same of the session's calibration, which `make` takes."""
    session = page.session
    return drawn(
        lambda: session.calibration,
        lambda: make(session.calibration) if session.calibration else "",
    )
