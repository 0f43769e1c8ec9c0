"""Step 4: calibrating, the rms, the five worst, and the ways to look at the result."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from nicegui import ui

from opencsp_calib.gui.choosing import PhotographTable
from opencsp_calib.gui.controls import action, quiet_action
from opencsp_calib.gui.procedure import calibrate, put_back, remove
from opencsp_calib.gui.session import Session
from opencsp_calib.quality import worst_views

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

COLUMNS: list[dict[str, Any]] = [
    {"name": "image", "label": "The five worst", "align": "left"},
    {"name": "rms", "label": "rms (px)"},
]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session

    def begin() -> None:
        page.show_result("Result")
        calibrate(session)

    solve = action("Calibrate Camera", begin, "calibrate")
    stale = ui.label("Something above was changed since: calibrate again.").classes("hint")
    with ui.element("div").classes("figure"):
        ui.label("Overall rms").classes("quiet")
        rms = ui.label().props("data-testid=rms").classes("value")
    looks = [
        quiet_action("Show reprojection error", lambda: page.show_result("Reprojection error"), "reprojection-error"),
        quiet_action("Visualize distortion", lambda: page.show_result("Distortion"), "visualize-distortion"),
    ]
    worst = PhotographTable(page, COLUMNS).props("data-testid=worst-images").classes("worst")
    change = _changing(page)

    def refresh() -> None:
        solved = session.calibration
        solve.set_enabled(session.can_calibrate)
        stale.set_visibility(session.can_calibrate and solved is not None and not session.is_solved)
        rms.set_text(f"{solved.rms_px:.4f} px" if solved else "not yet known")
        worst.fill(_worst(session))
        worst.set_visibility(solved is not None)
        for look in looks:
            look.set_enabled(solved is not None)
        change()

    return refresh


def _changing(page: "Page") -> Callable[[], None]:
    """The buttons that leave photographs out, and take them in again."""
    session = page.session

    def begin(change: Callable[[Session, set[str]], None], which: Callable[[], set[str]]) -> None:
        names = which()
        page.selected -= names
        page.show_result("Result")
        change(session, names)

    def used() -> set[str]:
        return {name for name in page.selected - session.removed if session.views.get(name, {}).get("status") == "used"}

    def removed() -> set[str]:
        return page.selected & session.removed

    with ui.element("div").classes("in-a-row"):
        out = quiet_action("Remove and recalibrate", lambda: begin(remove, used), "remove")
        again = quiet_action("Put back", lambda: begin(put_back, removed), "put-back")
    told = ui.label().classes("hint")

    def refresh() -> None:
        out.set_enabled(bool(used()) and session.can_calibrate)
        again.set_enabled(bool(removed()) and session.can_calibrate)
        for button in (out, again):
            button.set_visibility(session.calibration is not None)
        told.set_visibility(bool(session.removed))
        told.set_text(f"Left out: {', '.join(sorted(session.removed))}")

    return refresh


def _worst(session: Session) -> list[dict[str, Any]]:
    solved = session.calibration
    if solved is None:
        return []
    used, rms = solved.observations.used, solved.view_rms_px
    return [{"image": used[index].image, "rms": f"{rms[index]:.4f}"} for index in worst_views(solved)]
