"""The result in words: verdict and warnings first, then what changed, then the numbers."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from opencsp_calib.calibration import Calibration
from opencsp_calib.gui.drawn import of_calibration

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""

    def make(calibration: Calibration) -> str:
        from opencsp_calib.report import page as report

        before = page.session.before
        return report.summary(calibration) + report.changes(calibration, before) + report.parameters(calibration)

    return of_calibration(page, make)
