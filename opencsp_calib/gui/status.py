"""The line at the foot: what happened last; while work goes on, how far it is, the time left, and Cancel."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from nicegui import ui

from opencsp_calib.gui.news import Progress
from opencsp_calib.gui.wording import worded

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    line = ui.label().props("data-testid=status role=status aria-live=polite").classes("status")
    with ui.element("div").classes("work") as work:
        bar = ui.linear_progress(show_value=False, size="6px").props("rounded instant-feedback aria-label=Progress")
        ui.button("Cancel", on_click=session.cancel).props("no-caps outline dense data-testid=cancel")

    def refresh() -> None:
        progress = session.progress
        line.set_text(_said(progress) if progress else worded(session.message.text))
        line.classes(replace=f"status {session.message.level if not progress else 'info'}")
        work.set_visibility(progress is not None)
        if progress:
            bar.classes(replace="" if progress.total else "waiting")
            bar.set_value(progress.done / progress.total if progress.total else 0.0)

    return refresh


def _said(progress: Progress) -> str:
    text = f"{progress.what} …"
    if progress.total:
        text = f"{progress.what}: {progress.done} of {progress.total}"
    left = progress.seconds_left
    if left is None:
        return text
    return f"{text}, about {left:.0f} s left" if left < 90 else f"{text}, about {left / 60:.0f} min left"
