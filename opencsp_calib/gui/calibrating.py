"""Step 4: calibrating, the rms, and the ways to look at the result."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from nicegui import ui

from opencsp_calib.gui.controls import action, quiet_action
from opencsp_calib.gui.procedure import calibrate

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session

    def begin() -> None:
        page.show_result("Result")
        calibrate(session)

    solve = action("Calibrate Camera", begin, "calibrate")
    with ui.element("div").classes("figure"):
        ui.label("Overall rms").classes("quiet")
        rms = ui.label().props("data-testid=rms").classes("value")
    looks = [
        quiet_action("Show reprojection error", lambda: page.show_result("Reprojection error"), "reprojection-error"),
        quiet_action("Visualize distortion", lambda: page.show_result("Distortion"), "visualize-distortion"),
    ]

    def refresh() -> None:
        solve.set_enabled(session.can_calibrate)
        rms.set_text(f"{session.calibration.rms_px:.4f} px" if session.calibration else "not yet known")
        for look in looks:
            look.set_enabled(session.calibration is not None)

    return refresh
