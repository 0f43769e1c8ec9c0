"""Step 2: selecting photographs: from the browser's machine, dropped on the page, or a folder below DIR."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from opencsp_calib.counted import counted
from opencsp_calib.errors import CalibError
from opencsp_calib.gui.asking import may_forget
from opencsp_calib.gui.controls import action, field
from opencsp_calib.gui.files import within
from opencsp_calib.gui.kept import is_kept, take_up
from opencsp_calib.gui.session import Session

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


class PhotographInput(Element, component="photographs.js"):
    """Where photographs come in, with a session to tell of what comes; see the component.

    A batch that has not ended when its page is gone never will.
    """

    def __init__(self, session: Session) -> None:
        super().__init__()
        self._session = session
        self._batches: set[str] = set()
        self.on("begun", self._begun).on("ended", self._ended)
        ui.context.client.on_delete(self._gone)

    def _gone(self) -> None:
        for batch in self._batches:
            self._session.end_batch(batch)

    def _begun(self, event: GenericEventArguments) -> None:
        self._batches.add(event.args["batch"])
        self._session.selection.begin(event.args["batch"], event.args["count"])
        self._session.tell()

    def _ended(self, event: GenericEventArguments) -> None:
        self._batches.discard(event.args["batch"])
        self._session.end_batch(event.args["batch"])
        if event.args["lost"]:
            self._session.say(f"Not received: {', '.join(event.args['lost'])}. Select them again.", "bad")


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session

    async def forget() -> None:
        if await may_forget(session):
            session.forget_photographs()

    with PhotographInput(session) as entry:
        select = action("Select Images", lambda: None, "select-images")
        ui.label("or drop files or a folder here").classes("hint")
    # in the browser itself, which opens its file chooser only as the direct answer to a click
    select.on("click", js_handler=f"() => getElement({entry.id}).open()")
    _folder_field(page)
    with ui.element("div").classes("with-button"):
        count = ui.label().classes("count")
        clear = ui.button("Clear", on_click=forget).props("no-caps flat dense")

    def refresh() -> None:
        chosen = session.selection
        received = [f"{done} of {total} received" for done, total in chosen.receiving.values()]
        kept = f"corners from {session.kept}" if session.kept and not chosen.files else ""
        count.set_text("; ".join(received) or kept or counted(len(chosen.files), "photograph"))
        clear.set_enabled(bool(chosen.files or kept) and not session.busy and not chosen.receiving)
        select.set_enabled(not session.busy)

    return refresh


def _folder_field(page: "Page") -> None:
    session = page.session

    async def use() -> None:
        try:
            path = within(session.folder, folder.value)
            if not is_kept(path):
                source, found = session.selection.add(folder.value or ".")
                session.say(f"{counted(found, 'photograph')} in {source}.")
            elif await may_forget(session):
                take_up(session, path)
        except CalibError as error:
            session.say(str(error), "bad")

    with ui.element("div").classes("with-button"):
        folder = field("or a folder here", "", lambda _: None, "photograph-folder", "or a file of corners")
        folder.on("keydown.enter", use)
        ui.button("Use", on_click=use).props("no-caps flat dense")
