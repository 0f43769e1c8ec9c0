"""The page's parts, buttons and fields, made alike."""

from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui
from nicegui.element import Element

__all__ = ["Part", "action", "choice", "field", "offer", "quiet_action", "set_prop"]


class Part(Element, component="part.js"):
    """A part of the page, as an element with this tag; see the component."""

    def __init__(self, tag: str) -> None:
        super().__init__()
        self._props["tag"] = tag


def action(label: str, on_click: Callable[[], Any], testid: str = "") -> ui.button:
    """A button for a step of the procedure."""
    button = ui.button(label, on_click=on_click).props("no-caps unelevated").classes("action")
    return button.props(f"data-testid={testid}") if testid else button


def quiet_action(label: str, on_click: Callable[[], Any], testid: str = "") -> ui.button:
    """A button to look at something, or for what is seldom needed."""
    return action(label, on_click, testid).props("outline")


def field(label: str, value: str, on_change: Callable[[str], Any], testid: str = "", hint: str = "") -> ui.input:
    """A line to type into; the test id is that of the ``input`` element itself."""
    made = ui.input(label, value=value, on_change=lambda event: on_change(event.value or ""))
    made.props("outlined dense autocomplete=off").classes("field")
    # what sets the value without typing (a browser's own filling in, a test's clear) tells of it by this event only
    made.on("change", js_handler=f"(value) => {{ getElement({made.id}).inputValue = value ?? ''; }}")
    if hint:
        made.props["placeholder"] = hint
    return made.props(f"data-testid={testid}") if testid else made


def choice(label: str, options: Mapping[str, str], value: str, on_change: Callable[[str], Any]) -> ui.select:
    """One of several."""
    made = ui.select(_with(options, value), label=label, value=value, on_change=lambda event: on_change(event.value))
    return made.props("outlined dense options-dense").classes("field")


def offer(made: ui.select, options: Mapping[str, str]) -> None:
    """Have a choice offer these; what is chosen stays."""
    if _with(options, made.value) != made.options:
        made.set_options(_with(options, made.value))


def _with(options: Mapping[str, str], value: str) -> dict[str, str]:
    return dict(options) if value in options else {**options, value: value}


def set_prop(element: ui.element, name: str, value: Any) -> None:
    """Set a property, if it is new: setting one sends all, a field's value too, older than what is being typed."""
    if element.props.get(name) != value:
        element.props[name] = value
