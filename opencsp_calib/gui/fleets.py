"""Many cameras in one run, a folder each: what ``fleet`` does."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING, Any

from nicegui import ui

from opencsp_calib.counted import counted
from opencsp_calib.gui.controls import action, field
from opencsp_calib.gui.files import shown, within
from opencsp_calib.gui.news import Message

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

HINT = (
    "Each folder in it with photographs is a camera. Board, lens model and solver are those under Calibrate, unless a "
    "file fleet.yaml in it says otherwise. Each camera's folder gets camera.h5 and report.html; a camera.h5 of last "
    "time is compared with, then replaced."
)


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session

    async def work() -> None:
        given = {"board": session.board} if session.board else {}
        given |= {"model": session.settings.model, "solver": session.settings.solver}
        results = await session.job("fleet", where=str(within(session.folder, place.value or ".")), given=given)
        found.set_content(_told(results["cameras"]))
        bad = [one["name"] for one in results["cameras"] if one["verdict"] in ("bad", "failed")]
        text = f"{counted(len(results['cameras']), 'camera')} done, {len(bad)} of them bad or failed. "
        text += f"Report: {shown(session.folder, within(session.folder, results['report']))}"
        session.message = Message(text, "bad" if bad else "good")

    with ui.element("div").classes("two"):
        with ui.element("div").classes("narrow"):
            ui.html("<h2>Many cameras</h2>", sanitize=False)
            place = field("Folder of folders, or fleet.yaml", "", lambda _: None, "fleet-folder", ". (all of it)")
            ui.label(HINT).classes("hint")
            button = action("Calibrate all", lambda: session.start("Calibrating", work), "calibrate-fleet")
        found = ui.html("", sanitize=False).classes("report").props("data-testid=fleet-results")

    def refresh() -> None:
        button.set_enabled(not session.busy)

    return refresh


def _told(cameras: list[dict[str, Any]]) -> str:
    from opencsp_calib.report.html import table

    rows = [
        (
            one["name"],
            one["verdict"],
            f"{one['rms_px']:.4f}" if one["rms_px"] else "",
            f"{one['views_used']} of {one['images']}" if one["rms_px"] else "",
            one["change"]["level"] if one["change"] else "",
        )
        for one in cameras
    ]
    told = "".join(f"<li>{escape(one['name'])}: {escape(one['sentence'])}</li>" for one in cameras)
    return table(("camera", "verdict", "rms (px)", "images used", "since last time"), rows) + f"<ul>{told}</ul>"
