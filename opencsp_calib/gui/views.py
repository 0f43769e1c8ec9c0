"""All photographs, each as soon as it is looked at: thumbnail, corners, tilt, sharpness, rms, problems."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import ui

from opencsp_calib.gui.choosing import PhotographTable
from opencsp_calib.gui.session import Session

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

COLUMNS: list[dict[str, Any]] = [
    {"name": "picture", "label": "", "field": "picture", "align": "left"},
    {"name": "image", "label": "Photograph", "field": "image", "align": "left", "sortable": True},
    {"name": "status", "label": "Status", "field": "status", "align": "left", "sortable": True},
    {"name": "corners", "label": "Corners", "field": "corners", "sortable": True},
    {"name": "tilt", "label": "Tilt (°)", "field": "tilt", "sortable": True},
    {"name": "edge", "label": "Edges (px)", "field": "edge", "sortable": True},
    {"name": "rms", "label": "rms (px)", "field": "rms", "sortable": True},
    {"name": "problems", "label": "To know", "field": "problems", "align": "left", "classes": "wide"},
]
IN_SIGHT = (
    "virtual-scroll virtual-scroll-item-size=53 "  # the height of a row in px
    "virtual-scroll-slice-ratio-before=0.5 virtual-scroll-slice-ratio-after=0.5"
)
"""Draws the rows that can be seen, and half as many before and after them: each costs time whenever one changes."""

START = (
    "Describe the board on the left and select about 50 photographs of it: tilted by 30 to 45 degrees to every side, "
    "half of them with the board turned by 90 degrees, together filling the whole image. Each photograph is listed "
    "here with its corners, its tilt, how wide its edges are (sharp ones: 0.7 px) and what is to be known about it."
)


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    table = PhotographTable(page, COLUMNS).props(f"{IN_SIGHT} data-testid=images").classes("views")
    empty = ui.label(START).classes("quiet empty")

    def refresh() -> None:
        names = [file.name for file in session.selection.files] or list(session.views)
        rms, dropped = _rms(session), _dropped(session)
        table.fill([_row(session, name, rms, dropped) for name in names])
        table.set_visibility(bool(names))
        empty.set_visibility(not names)

    return refresh


def _rms(session: Session) -> dict[str, float]:
    solved = session.calibration
    if solved is None:
        return {}
    return {view.image: float(rms) for view, rms in zip(solved.observations.used, solved.view_rms_px, strict=True)}


def _dropped(session: Session) -> dict[str, str]:
    """Photographs that the calibration was solved without, and why."""
    solved = session.calibration
    views = solved.observations.views if solved else ()
    return {view.image: view.problems[-1].message for view in views if view.status == "dropped" and view.problems}


def _row(session: Session, image: str, rms: dict[str, float], dropped: dict[str, str]) -> dict[str, Any]:
    view, place = session.views.get(image, {}), str(session.selection.path_of(image))
    told = [problem["message"] for problem in view.get("problems", ())]
    told += [dropped[image]] if image in dropped else []
    return {
        "image": image,
        "picture": f"photographs?image={quote(image)}",
        "status": "left out" if image in session.removed or image in dropped else view.get("status", ""),
        "corners": view.get("corners"),
        "tilt": _rounded(view.get("tilt_deg"), 0),
        "edge": _rounded(view.get("edge_width_px"), 2),
        "rms": _rounded(rms.get(image), 4),
        "problems": "; ".join(told).replace(place, image),
    }


def _rounded(value: float | None, digits: int) -> str | None:
    return None if value is None else f"{value:.{digits}f}"
