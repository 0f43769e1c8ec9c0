"""Where the boards stood before the camera, and where the camera stood before the board, in space."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from nicegui import ui
from nicegui.element import Element

from opencsp_calib.arrays import Points
from opencsp_calib.calibration import Calibration

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

Line = dict[str, Any]


class Lines(Element, component="lines.js"):
    """Lines in space; see the component."""

    def __init__(self, label: str, turn: tuple[float, float]) -> None:
        super().__init__()
        self._props.update(lines=[], label=label, turn=turn)


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    shown: list[Any] = [None]
    views = []
    with ui.element("div").classes("report"), ui.element("div").classes("side"):
        for title, make, turn in (
            ("Seen from the camera", boards_before_camera, (0.6, 0.35)),
            ("Seen from the board", cameras_before_board, (0.6, 0.35)),
        ):
            with ui.element("div"):
                ui.html(f"<h2>{title}</h2>", sanitize=False)
                lines = Lines(title, turn).on("chosen", lambda event: page.look_at(str(event.args)))
                views.append((lines, make))
    ui.label(
        "Drag to turn, wheel to come nearer; or arrow keys, + and −. A red corner marks each board's first corner. A "
        "click on a board or a camera opens its photograph."
    ).classes("hint")

    def refresh() -> None:
        calibration = session.calibration
        if calibration is shown[0]:
            return
        shown[0] = calibration
        for lines, make in views:
            lines.props["lines"] = make(calibration) if calibration else []

    return refresh


def boards_before_camera(calibration: Calibration) -> list[Line]:
    """Every board in the camera's frame (x right, y down, z forward), and the camera."""
    outline, mark = _outline(calibration), _first_corner(calibration)
    lines = [_line("camera", calibration.camera.name, _frustum(calibration))]
    for view, pose in zip(calibration.observations.used, calibration.cam_from_board, strict=True):
        lines.append(_line("board", view.image, pose.transform(outline)))
        lines.append(_line("first", view.image, pose.transform(mark)))
    return lines


def cameras_before_board(calibration: Calibration) -> list[Line]:
    """Every camera in the board's frame, and the board."""
    frustum = _frustum(calibration)
    board = calibration.board.spec
    lines = [_line("board", board, _outline(calibration)), _line("first", board, _first_corner(calibration))]
    for view, pose in zip(calibration.observations.used, calibration.cam_from_board, strict=True):
        lines.append(_line("camera", view.image, pose.inverse().transform(frustum)))
    return lines


def _line(kind: str, name: str, points: Points) -> Line:
    return {"kind": kind, "name": name, "points": np.round(points, 6).tolist()}


def _outline(calibration: Calibration) -> Points:
    columns, rows = calibration.board.grid
    return np.asarray(calibration.board.points[[0, columns - 1, columns * rows - 1, columns * (rows - 1), 0]])


def _first_corner(calibration: Calibration) -> Points:
    columns, rows = calibration.board.grid
    origin = calibration.board.points[0]
    ends = calibration.board.points[[columns - 1, columns * (rows - 1)]]
    return np.array([origin + 0.2 * (ends[0] - origin), origin, origin + 0.2 * (ends[1] - origin)])


def _frustum(calibration: Calibration) -> Points:
    """From the projection centre to the image's corners, a fifth of the way to the boards."""
    width, height = calibration.camera.image_size
    corners = np.array([[-0.5, -0.5], [width - 0.5, -0.5], [width - 0.5, height - 0.5], [-0.5, height - 0.5]])
    matrix = np.linalg.inv(calibration.camera.matrix)  # without distortion: a sketch
    depth = 0.2 * float(np.median([np.linalg.norm(pose.translation) for pose in calibration.cam_from_board]))
    a, b, c, d = np.column_stack([corners, np.ones(4)]) @ matrix.T * depth
    centre = np.zeros(3)
    return np.array([centre, a, b, centre, c, d, centre, a, d, c, b])
