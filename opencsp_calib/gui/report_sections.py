"""What the page shows as the report does: the result in words, the distortion, the board's shape, the uncertainty."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from opencsp_calib.calibration import Calibration
from opencsp_calib.gui.drawn import of_calibration

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["board_shape", "distortion", "result", "uncertainty"]

AS_GIVEN = (
    "<h2>The board as solved</h2><p>The board was taken as flat. Where the photographs are good enough, board shape "
    "<i>free</i> (More options) solves for the height of every corner.</p>"
)


def result(page: "Page") -> Callable[[], None]:
    """Verdict and warnings first, then what changed, then the numbers. For this and the next see `page.py`."""

    def make(calibration: Calibration) -> str:
        from opencsp_calib.report import page as report

        before = page.session.before
        return report.summary(calibration) + report.changes(calibration, before) + report.parameters(calibration)

    return of_calibration(page, make)


def distortion(page: "Page") -> Callable[[], None]:
    """Radial, tangential and total as arrows, and a map of its size."""

    def make(calibration: Calibration) -> str:
        from opencsp_calib.report.page import distortion as drawn

        return drawn(calibration)

    return of_calibration(page, make)


def board_shape(page: "Page") -> Callable[[], None]:
    """The board's heights, and its deviations in plane."""

    def make(calibration: Calibration) -> str:
        from opencsp_calib.report.board_section import board_section

        return board_section(calibration) or AS_GIVEN

    return of_calibration(page, make)


def uncertainty(page: "Page") -> Callable[[], None]:
    """How far to trust the result: over the image, over range, and what single views do to it."""

    def make(calibration: Calibration) -> str:
        from opencsp_calib.report.trust_section import trust_section

        return trust_section(calibration)

    return of_calibration(page, make)
