"""Tables of photographs; which of them are selected is shared by all tables of the page."""

import json
from typing import TYPE_CHECKING, Any

from nicegui.element import Element
from nicegui.events import GenericEventArguments

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["PhotographTable"]


class PhotographTable(Element, component="photograph_table.js"):
    """A table whose rows are photographs; see the component."""

    def __init__(self, page: "Page", columns: list[dict[str, Any]]) -> None:
        super().__init__()
        self._page = page
        self._here: set[str] = set()
        self._props.update(columns=columns, rows="[]", selected=[])
        self.on("select", self._select).on("look", lambda event: page.look_at(event.args))

    def fill(self, rows: list[dict[str, Any]]) -> None:
        """Show rows, and which of them are selected."""
        self._here = {row["image"] for row in rows}
        chosen = [row["image"] for row in rows if row["image"] in self._page.selected]
        for name, value in (("rows", json.dumps(rows)), ("selected", chosen)):
            if self._props[name] != value:
                self.props[name] = value

    def _select(self, event: GenericEventArguments) -> None:
        self._page.selected = (self._page.selected - self._here) | set(event.args)
        self._page.refresh()
