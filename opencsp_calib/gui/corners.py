"""Step 3: finding the corners, and looking at them."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from nicegui import ui

from opencsp_calib.gui.controls import action, quiet_action
from opencsp_calib.gui.procedure import find_corners

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session

    def find() -> None:
        page.show_result("Photographs")
        find_corners(session)

    with ui.element("div").classes("in-a-row"):
        search = action("Find Corners", find, "find-corners")
        view = quiet_action("View Found Corners", lambda: page.show_result("Found corners"), "view-corners")
    stale = ui.label("Board or photographs changed since: find the corners again.").classes("hint")

    def refresh() -> None:
        search.set_enabled(session.can_find)
        view.set_enabled(session.observations is not None)
        stale.set_visibility(session.observations is not None and not session.is_found and not session.busy)

    return refresh
