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
    {"name": "picture", "label": "", "align": "left"},
    {"name": "image", "label": "Photograph", "align": "left", "sortable": True},
    {"name": "status", "label": "Status", "align": "left", "sortable": True},
    {"name": "corners", "label": "Corners", "sortable": True},
    {"name": "tilt", "label": "Tilt (°)", "sortable": True},
    {"name": "edge", "label": "Edges (px)", "sortable": True},
    {"name": "rms", "label": "rms (px)", "sortable": True},
    {"name": "problems", "label": "To know", "align": "left"},
]
START = (
    "Describe the board on the left and select about 50 photographs of it: tilted by 30 to 45 degrees to every side, "
    "half of them with the board turned by 90 degrees, together filling the whole image. Each photograph is listed "
    "here with its corners, its tilt, how wide its edges are (sharp ones: 0.7 px) and what is to be known about it."
)


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    table = PhotographTable(page, COLUMNS).props("data-testid=images").classes("views")
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
    view, place = session.views.get(image, {}), str(session.selection.paths.get(image, image))
    told = [problem["message"] for problem in view.get("problems", ())]
    told += [dropped[image]] if image in dropped else []
    return {
        "image": image,
        "picture": _picture(session, image, view.get("status")),
        "status": "left out" if image in session.removed or image in dropped else view.get("status", ""),
        "corners": view.get("corners"),
        "tilt": _rounded(view.get("tilt_deg"), 0),
        "edge": _rounded(view.get("edge_width_px"), 2),
        "rms": _rounded(rms.get(image), 4),
        "problems": "; ".join(told).replace(place, image),
    }


def _picture(session: Session, image: str, status: str | None) -> str | None:
    """The address of its thumbnail; while the board is looked for, of those that this has made."""
    if image not in session.selection.paths or status == "unreadable" or (session.looking and not status):
        return None
    # once looked at, another address: the first may have been asked for while it was not to be had
    return f"photographs?image={quote(image)}{'&seen' if status else ''}"


def _rounded(value: float | None, digits: int) -> str | None:
    return None if value is None else f"{value:.{digits}f}"
