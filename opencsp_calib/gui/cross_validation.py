"""Every solver, both halves of the views and the lens models on the same corners: whether they agree."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

from nicegui import ui

from opencsp_calib.gui.controls import quiet_action
from opencsp_calib.gui.drawn import drawn
from opencsp_calib.gui.news import Message
from opencsp_calib.gui.session import Session

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    ui.label(
        "Lets every installed solver, the odd and the even views, and the lens models in order answer the same "
        "question. It takes some seconds to a minute."
    ).classes("quiet")

    def begin() -> None:
        session.start("Cross-validating", partial(_validate, session))

    button = quiet_action("Cross-validate", begin).classes("short")
    found = session.own / "validation.html"

    def key() -> float | None:
        if session.calibration is None or not found.exists():
            return None
        fresh = found.stat().st_mtime_ns > session.file("calibration").stat().st_mtime_ns
        return found.stat().st_mtime_ns if fresh else None  # else it is of another calibration

    told = drawn(key, lambda: found.read_text(encoding="utf-8"))

    def refresh() -> None:
        button.set_enabled(session.calibration is not None and not session.busy)
        told()

    return refresh


async def _validate(session: Session) -> None:
    from opencsp_calib.validate import SENTENCES

    verdict = await session.job(
        "validate", calibration=str(session.file("calibration")), sections=str(session.file("validation", "html"))
    )
    session.message = Message(SENTENCES[verdict], "good" if verdict == "agree" else "bad")
