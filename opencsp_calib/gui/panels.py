"""What the tabs of the page bring to the front: all of them lie over each other, and one is seen.

Those behind keep their place and size. To show one costs the browser a third of what making it anew does, and the page
must answer while both cores look for corners.
"""

from nicegui import ui
from nicegui.element import Element

from opencsp_calib.gui.controls import Part

__all__ = ["Panels"]


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
        self._panels: dict[str, Part] = {}
        tabs.on_value_change(self._show)

    def add(self, name: str, classes: str) -> Part:
        """Make the panel of a tab, to be filled."""
        with self:
            self._panels[name] = Part("div").classes(classes).props(f'role=tabpanel aria-label="{name}"')
        if self._tabs.value is None:
            self._tabs.set_value(name)
        self._show()
        return self._panels[name]

    def _show(self) -> None:
        for name, panel in self._panels.items():
            behind = name != self._tabs.value
            panel.classes(add="behind" if behind else "", remove="" if behind else "behind")
