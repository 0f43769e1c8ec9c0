"""The rms of each view in order of capture, and the residuals over the image; a click on a bar opens its photograph."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui
from nicegui.events import EChartPointClickEventArguments

from opencsp_calib.calibration import Calibration
from opencsp_calib.gui.drawn import of_calibration
from opencsp_calib.quality import worst_views

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

FAIR, WORSE, QUIET = "#2b8cb8", "#d2694f", "#7c8890"  # legible on light and on dark


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session

    def clicked(event: EChartPointClickEventArguments) -> None:
        page.look_at(event.name)

    title = ui.html("<h2>Each view, in order of capture</h2>", sanitize=False).classes("report")
    chart = (
        ui.echart({}, on_point_click=clicked, renderer="svg")
        .classes("bars")
        .props('role=img aria-label="rms of each view"')
    )
    hint = ui.label("A click on a bar opens its photograph. The dashed line is the rms of all views.").classes("hint")
    rest = of_calibration(page, _residuals)
    shown: list[Any] = [None]

    def refresh() -> None:
        calibration = session.calibration
        for element in (title, chart, hint):
            element.set_visibility(calibration is not None)
        if calibration is not None and calibration is not shown[0]:
            shown[0] = calibration
            chart.options.clear()
            chart.options.update(_bars(calibration))
            chart.update()
        rest()

    return refresh


def _residuals(calibration: Calibration) -> str:
    from opencsp_calib.report.page import residuals

    return residuals(calibration)


def _bars(calibration: Calibration) -> dict[str, Any]:
    names = [view.image for view in calibration.observations.used]
    rms = calibration.view_rms_px
    worst = worst_views(calibration)
    bars = [
        {"value": float(value) if np.isfinite(value) else None, "itemStyle": {"color": WORSE if n in worst else FAIR}}
        for n, value in enumerate(rms)
    ]
    line = {"yAxis": calibration.rms_px, "label": {"formatter": f"{calibration.rms_px:.4f}", "color": QUIET}}
    return {
        "animation": False,
        "textStyle": {"fontFamily": "inherit"},
        "grid": {"left": 60, "right": 60, "top": 32, "bottom": 64},
        "tooltip": {"trigger": "axis", ":valueFormatter": "value => value.toFixed(4) + ' px'"},
        "xAxis": {"type": "category", "data": names, "axisLabel": {"rotate": 60, "color": QUIET}},
        "yAxis": {
            "type": "value",
            "name": "rms (px)",
            "axisLabel": {"color": QUIET},
            "nameTextStyle": {"color": QUIET},
            "splitLine": {"lineStyle": {"color": QUIET, "opacity": 0.35}},
        },
        "series": [
            {
                "type": "bar",
                "data": bars,
                "barMaxWidth": 40,
                "markLine": {
                    "data": [line],
                    "precision": 6,
                    "symbol": "none",
                    "lineStyle": {"color": QUIET},
                    "silent": True,
                },
            }
        ],
    }
