"""Fields for the session's settings, the same on every page that shows them."""

from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui
from nicegui.elements.mixins.value_element import ValueElement

from opencsp_calib.gui.controls import choice, field
from opencsp_calib.gui.session import Session

__all__ = ["SettingFields"]


class SettingFields:
    """Makes fields, each of one setting of the session."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self._made: list[tuple[str, ValueElement[Any]]] = []
        ui.context.client.on_connect(self._hear)

    def line(self, setting: str, label: str, testid: str = "", hint: str = "") -> ui.input:
        """A line to type into."""
        made = field(label, self._value(setting), self._take(setting), testid, hint)
        self._made.append((setting, made))
        return made

    def option(self, setting: str, label: str, options: Mapping[str, str]) -> ui.select:
        """One of several."""
        made = choice(label, options, self._value(setting), self._take(setting))
        self._made.append((setting, made))
        return made

    def tick(self, setting: str, label: str) -> ui.checkbox:
        """Yes or no."""
        take = self._take(setting)
        made = ui.checkbox(label, value=self._value(setting), on_change=lambda event: take(event.value))
        self._made.append((setting, made))
        return made

    def text(self, setting: str, label: str) -> ui.textarea:
        """Several lines."""
        take = self._take(setting)
        made = ui.textarea(label, value=self._value(setting), on_change=lambda event: take(event.value or ""))
        self._made.append((setting, made))
        return made.props("outlined dense autogrow").classes("field")

    def refresh(self) -> None:
        """Show what was changed on another page; what is typed here the session knows already."""
        for setting, made in self._made:
            if made.value != self._value(setting):
                made.set_value(self._value(setting))

    async def _hear(self) -> None:
        """Take what was typed before the page was connected: its events come late, and out of order."""
        typed = {setting: made for setting, made in self._made if isinstance(made, ui.input)}
        fields = ", ".join(f"{setting}: getElement({made.id})?.inputValue" for setting, made in typed.items())
        pause = "await new Promise((done) => setTimeout(done, 200));"
        try:
            values = await ui.context.client.run_javascript(f"{pause} return {{{fields}}};", timeout=60)
        except TimeoutError:  # the page was loaded again before it could answer
            return
        if values is None:  # it was closed
            return
        for setting, made in typed.items():
            if isinstance(values.get(setting), str) and values[setting] != made.value:
                made.set_value(values[setting])

    def _value(self, setting: str) -> Any:
        return getattr(self.session.settings, setting)

    def _take(self, setting: str) -> Callable[[Any], None]:
        return lambda value: self.session.choose(setting, value)
