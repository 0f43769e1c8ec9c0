"""What the tabs of the page bring to the front: all of them lie over each other, and one is seen.

Those behind keep their place and size. To show one costs the browser a fraction of what making it anew does, and the
page must answer while both cores look for corners.
"""

from nicegui import ui
from nicegui.element import Element

from opencsp_calib.gui.controls import Part, set_prop

__all__ = ["Panels"]


class Front(Element, component="front.js"):
    """Which panel is seen; see the component."""


class Panels(Element):
    """The panels of some tabs; each is a part of the page, and there before it is shown.

    Parameters
    ----------
    tabs : ui.tabs
        The panel that is added first is the first to be seen.
    """

    def __init__(self, tabs: ui.tabs) -> None:
        super().__init__("div")
        self.classes("panels")
        self._tabs = tabs
        with self, Part("i").props("hidden"):  # a part, so that a change of it draws nothing else
            self._front = Front()
        tabs.on_value_change(self._show)

    def add(self, name: str, classes: str) -> Part:
        """Make the panel of a tab, to be filled."""
        with self:
            panel = Part("div").classes(classes).props(f'role=tabpanel aria-label="{name}"')
        if self._tabs.value is None:
            self._tabs.set_value(name)
        self._show()
        return panel

    def _show(self) -> None:
        set_prop(self._front, "name", self._tabs.value)
