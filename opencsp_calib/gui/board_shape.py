"""The board as solved: its heights, and its deviations in plane."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from opencsp_calib.calibration import Calibration
from opencsp_calib.gui.drawn import of_calibration

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

AS_GIVEN = (
    "<h2>The board as solved</h2><p>The board was taken as flat. Where the photographs are good enough, board shape "
    "<i>free</i> (More options) solves for the height of every corner.</p>"
)


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""

    def make(calibration: Calibration) -> str:
        from opencsp_calib.report.board_section import board_section

        return board_section(calibration) or AS_GIVEN

    return of_calibration(page, make)
