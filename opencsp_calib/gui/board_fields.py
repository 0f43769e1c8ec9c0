"""Step 1: the camera's name, the board, lens model and solver, and what is seldom changed."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from nicegui import ui

from opencsp_calib.errors import InputError
from opencsp_calib.gui.controls import choice, field
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.registry import installed

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

DICTIONARIES = [f"DICT_{size}X{size}_{count}" for size in (4, 5, 6, 7) for count in (50, 100, 250, 1000)]
DICTIONARIES += ["DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9", "DICT_APRILTAG_36h11"]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    chosen = session.settings

    def take(name: str) -> Callable[[object], None]:
        return lambda value: session.choose(**{name: value})

    field("Camera name", chosen.camera_name, take("camera_name"), "camera-name", "camera")
    kind = choice("Board", {name: name for name in sorted(installed().boards)}, chosen.board_kind, take("board_kind"))
    with ui.element("div").classes("side-by-side") as grid:
        across = field("Grid points x", chosen.grid_x, take("grid_x"), "grid-x", "18")
        down = field("Grid points y", chosen.grid_y, take("grid_y"), "grid-y", "23")
    square = field("Square size in mm", chosen.square_mm, take("square_mm"), "square-size", "50")
    with ui.element("div").classes("group") as markers:
        field("Marker size in mm", chosen.marker_mm, take("marker_mm"), hint="40.5")
        choice("Dictionary", {name: name for name in DICTIONARIES}, chosen.dictionary, take("dictionary"))
        ui.checkbox("White on black", value=chosen.inverted, on_change=lambda e: session.choose(inverted=e.value))
        ui.checkbox("Layout before OpenCV 4.6", value=chosen.legacy, on_change=lambda e: session.choose(legacy=e.value))
    described = field("Description of the board", chosen.board_spec, take("board_spec"))
    said = ui.label().classes("hint")
    with ui.element("div").classes("side-by-side"):
        model = choice("Lens model", {name: name for name in LENS_MODELS}, chosen.model, take("model"))
        solvers = {name: name for name, solver in sorted(installed().solvers.items()) if solver.missing() is None}
        solver = choice("Solver", solvers, chosen.solver, take("solver"))
    with ui.expansion("More options").classes("more").props("dense"):
        _options(page, take)

    def refresh() -> None:
        now = session.settings
        for fields, kinds in ((grid, BY_SIZE), (square, BY_SIZE), (markers, ("charuco",))):
            fields.set_visibility(now.board_kind in kinds)
        described.set_visibility(now.board_kind not in BY_SIZE)
        squares = now.board_kind == "charuco"
        across.props["label"], down.props["label"] = ("Squares x", "Squares y") if squares else GRID_POINTS
        said.set_text(_said(page))
        for made in (model, solver):
            made.set_enabled(not now.preset)
        kind.set_value(now.board_kind)

    return refresh


BY_SIZE = ("checkerboard", "charuco")
GRID_POINTS = ("Grid points x", "Grid points y")


def _said(page: "Page") -> str:
    """What is still missing of the board, once something is typed; else what grid points are."""
    now = page.session.settings
    if now.board_kind in BY_SIZE and not (now.grid_x and now.grid_y and now.square_mm):
        return "Grid points are the inner corners, where two black squares meet." if now.board_kind != "charuco" else ""
    try:
        now.board()
    except InputError as error:
        return str(error)
    return ""


def _options(page: "Page", take: Callable[[str], Callable[[object], None]]) -> None:
    chosen = page.session.settings
    default = {"": "default"}
    choice("Preset", {"": "none", "opencsp": "exactly as OpenCSP"}, chosen.preset, take("preset"))
    shapes = {name: name for name in ("auto", "flat", "warp", "free")}
    choice("Board shape", shapes, chosen.board_shape, take("board_shape"))
    field("Pixel aspect: free, square, or fy/fx", chosen.pixel_aspect, take("pixel_aspect"), hint="free")
    choice("Weights", default | {"equal": "equal", "covariance": "by covariance"}, chosen.weights, take("weights"))
    choice("Leave out outlying corners", default | {"yes": "yes", "no": "no"}, chosen.robust, take("robust"))
    detectors = default | {name: name for name, d in sorted(installed().detectors.items()) if d.missing() is None}
    choice("Detector", detectors, chosen.detector, take("detector"))
    located = {"none": "as found", "subpix": "OpenCV's search", "model": "fit of the image of a corner"}
    choice("Corners located by", default | located, chosen.refine, take("refine"))
    field("Camera file to start from", chosen.guess, take("guess"))
    field("Pixel size in µm", chosen.pixel_pitch_um, take("pixel_pitch_um"))
    notes = ui.textarea("Notes, one KEY=VALUE a line", value=chosen.notes).props("outlined dense autogrow")
    notes.classes("field").on_value_change(lambda event: page.session.choose(notes=event.value or ""))
