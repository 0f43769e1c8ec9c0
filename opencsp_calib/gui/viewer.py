"""The photographs one by one, whole: corners in their order, rejected ones, residual arrows; failed ones too."""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any
from urllib.parse import quote

import numpy as np
from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from opencsp_calib.counted import counted
from opencsp_calib.detection import View
from opencsp_calib.gui.routes import WHOLE_PX
from opencsp_calib.gui.session import Session
from opencsp_calib.report.photographs import enlargement

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


class Photograph(Element, component="photograph.js"):
    """One photograph; see the component."""

    def __init__(self) -> None:
        super().__init__()
        self._props.update(_nothing())


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    shown: list[Any] = [None]

    def step(by: int) -> None:
        names = [view.image for view in session.observations.views] if session.observations else []
        if names:
            page.image = names[(names.index(page.image) + by) % len(names)] if page.image in names else names[0]
            page.refresh()

    def stepped(event: GenericEventArguments) -> None:
        step(int(event.args))

    def zoom(factor: float) -> None:
        photograph.run_method("magnify", factor)

    photograph: Photograph
    with ui.element("div").classes("viewer"):
        with ui.element("div").classes("toolbar"):
            ui.button(icon="chevron_left", on_click=lambda: step(-1)).props(
                'flat dense aria-label="Previous photograph"'
            )
            title = ui.label().classes("viewer-title").props("data-testid=viewed")
            ui.button(icon="chevron_right", on_click=lambda: step(1)).props('flat dense aria-label="Next photograph"')
            order = ui.checkbox("Order", value=True, on_change=page.refresh).props("dense")
            arrows = ui.checkbox("Residuals", value=True, on_change=page.refresh).props("dense")
            ui.button(icon="remove", on_click=partial(zoom, 1 / 1.5)).props('flat dense aria-label="Zoom out"')
            ui.button(icon="add", on_click=partial(zoom, 1.5)).props('flat dense aria-label="Zoom in"')
            ui.button("All of it", on_click=lambda: photograph.run_method("fit")).props("flat dense no-caps")
        photograph = Photograph().on("step", stepped)
        caption = ui.label().classes("hint")

    def refresh() -> None:
        views = session.observations.views if session.observations else ()
        index = next((n for n, view in enumerate(views) if view.image == page.image), 0)
        key = (session.observations, session.calibration, index, order.value, arrows.value)
        if key == shown[0]:
            return
        shown[0] = key
        view = views[index] if views else None
        title.set_text(f"{view.image} ({index + 1} of {len(views)})" if view else "No photograph yet")
        told, enlarged = _props(session, view, with_arrows=bool(arrows.value)) if view else (_nothing(), 0.0)
        told["order"] = bool(order.value)
        for name, value in told.items():
            photograph.props[name] = value
        caption.set_text(_caption(session, view, enlarged) if view else "")
        if view:
            page.image = view.image

    return refresh


def _nothing() -> dict[str, Any]:
    return {
        "name": "", "url": "", "width": 1, "height": 1, "columns": 1, "corners": [], "rejected": [], "arrows": [],
        "order": True,
    }  # fmt: skip


def _props(session: Session, view: View, *, with_arrows: bool) -> tuple[dict[str, Any], float]:
    """What the component shows, and how much the arrows are enlarged."""
    detection, observations = view.detection, session.observations
    width, height = observations.image_size if observations else (1, 1)
    told = _nothing() | {
        "name": view.image,
        "url": f"photographs?image={quote(view.image)}&side={WHOLE_PX}",
        "width": width,
        "height": height,
        "columns": observations.board.grid[0] if observations else 1,
        "corners": [
            [int(i), round(x, 3), round(y, 3)] for i, (x, y) in zip(detection.ids, detection.pixels, strict=True)
        ],
        "rejected": [[corner.id, *corner.pixel] for corner in detection.rejected],
    }
    residuals = _residuals(session, view)
    calibration = session.calibration
    if residuals is None or calibration is None or not with_arrows or len(residuals) != len(detection):
        return told, 0.0
    enlarged = enlargement(calibration)
    told["arrows"] = [
        [round(float(dx), 3), round(float(dy), 3)] if np.isfinite(dx + dy) else [None, None]
        for dx, dy in residuals * enlarged
    ]
    return told, enlarged


def _residuals(session: Session, view: View) -> Any:
    if session.calibration is None:
        return None
    used = [one.image for one in session.calibration.observations.used]
    return session.calibration.residuals[used.index(view.image)] if view.image in used else None


def _caption(session: Session, view: View, enlarged: float) -> str:
    status = "left out" if view.image in session.removed else view.status
    parts = [f"{status}, {counted(len(view.detection), 'corner')}"]
    if session.calibration is not None:
        used = [one.image for one in session.calibration.observations.used]
        if view.image in used:
            parts.append(f"rms {session.calibration.view_rms_px[used.index(view.image)]:.4f} px")
    if enlarged:
        parts.append(f"residuals enlarged {enlarged:.0f} times")
    return "; ".join([", ".join(parts), *(problem.message for problem in view.problems)])
