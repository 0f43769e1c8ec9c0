"""How far to trust the result: over the image, over range, and what single views do to it."""

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
        from opencsp_calib.report.trust_section import trust_section

        return trust_section(calibration)

    return of_calibration(page, make)
