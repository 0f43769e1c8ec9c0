"""The distortion: radial, tangential and total as arrows, and a map of its size."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from opencsp_calib.gui.drawn import of_calibration
from opencsp_calib.report import page as report

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    return of_calibration(page, report.distortion)
