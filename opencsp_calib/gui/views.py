"""All photographs, each as soon as it is looked at: thumbnail, corners, tilt, sharpness, rms, problems."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

from nicegui import ui

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
    {"name": "edge", "label": "Edge width (px)", "field": "edge", "sortable": True},
    {"name": "rms", "label": "rms (px)", "field": "rms", "sortable": True},
    {"name": "problems", "label": "To know", "field": "problems", "align": "left", "classes": "wide"},
]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    table = ui.table(columns=COLUMNS, rows=[], row_key="image", pagination={"rowsPerPage": 0})
    table.props("flat virtual-scroll hide-bottom data-testid=images").classes("views")
    table.add_slot(
        "body-cell-picture",
        '<q-td :props="props"><img class="thumbnail" loading="lazy" :src="props.row.picture" alt="" /></q-td>',
    )

    def refresh() -> None:
        rows = [_row(session, file.name) for file in session.selection.files]
        if rows != table.rows:
            table.rows = rows

    return refresh


def _row(session: Session, image: str) -> dict[str, Any]:
    view = session.views.get(image, {})
    status = view.get("status", "")
    return {
        "image": image,
        "picture": f"photographs?image={quote(image)}",
        "status": status,
        "corners": view.get("corners", "") if view else "",
        "tilt": _digits(view.get("tilt_deg"), 0),
        "edge": _digits(view.get("edge_width_px"), 2),
        "rms": "",
        "problems": "; ".join(problem["message"] for problem in view.get("problems", ())),
    }


def _digits(value: float | None, digits: int) -> str:
    return "" if value is None else f"{value:.{digits}f}"
