"""Step 1: the camera's name, the board, lens model and solver, and what is seldom changed."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from nicegui import ui

from opencsp_calib.errors import InputError
from opencsp_calib.gui.board_text import board_text
from opencsp_calib.gui.controls import offer, set_prop
from opencsp_calib.gui.session import Session
from opencsp_calib.gui.setting_fields import SettingFields
from opencsp_calib.gui.settings import BY_FIELDS, COUNTED, FILE
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.registry import installed

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

DICTIONARIES = [f"DICT_{size}X{size}_{count}" for size in (4, 5, 6, 7) for count in (50, 100, 250, 1000)]
DICTIONARIES += ["DICT_ARUCO_ORIGINAL", "DICT_APRILTAG_16h5", "DICT_APRILTAG_25h9", "DICT_APRILTAG_36h11"]
DEFAULT = {"": "default"}
DESCRIBED, IN_FILE = "Description of the board", "Board file, or camera file"


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session, fields = page.session, SettingFields(page.session)
    with ui.element("div").classes("side-by-side right-wider"):
        fields.line("camera_name", "Camera name", "camera-name", "camera")
        fields.option("board_kind", "Board", {name: name for name in sorted(installed().boards)} | {FILE: "in a file"})
    with ui.element("div").classes("side-by-side") as grid:
        across = fields.line("grid_x", COUNTED["checkerboard"][0], "grid-x", "18")
        down = fields.line("grid_y", COUNTED["checkerboard"][1], "grid-y", "23")
    square = fields.line("square_mm", "Square size in mm", "square-size", "50")
    with ui.element("div").classes("group") as markers:
        fields.line("marker_mm", "Marker size in mm", hint="40.5")
        fields.option("dictionary", "Dictionary", {name: name for name in DICTIONARIES})
        fields.tick("inverted", "White on black").props("dense")
        fields.tick("legacy", "Layout before OpenCV 4.6").props("dense")
    described = fields.line("board_spec", DESCRIBED, "board-described")
    said = ui.label().classes("hint")
    with ui.element("div").classes("side-by-side"):
        solved_by = [
            fields.option("model", "Lens model", {name: name for name in LENS_MODELS}),
            fields.option("solver", "Solver", {}),
        ]
    with ui.expansion("More options").classes("more").props("dense"):
        detector = _options(fields)

    def refresh() -> None:
        fields.refresh()
        now = session.settings
        if session.offered:
            offer(solved_by[1], session.offered.solvers)
            offer(detector, DEFAULT | session.offered.detectors)
        for element, kinds in ((grid, BY_FIELDS), (square, BY_FIELDS), (markers, ("charuco",))):
            element.set_visibility(now.board_kind in kinds)
        described.set_visibility(now.board_kind not in BY_FIELDS)
        for count, label in zip((across, down), COUNTED.get(now.board_kind, COUNTED["checkerboard"]), strict=True):
            set_prop(count, "label", label)
        set_prop(described, "label", IN_FILE if now.board_kind == FILE else DESCRIBED)
        said.set_text(_said(session))
        said.set_visibility(bool(said.text))
        for made in solved_by:
            made.set_enabled(not now.preset)

    return refresh


def _said(session: Session) -> str:
    """What is wrong with the first field that is wrong; until all of the board is typed, else, what grid points are."""
    now = session.settings
    try:
        now.check_typed()
        if now.board_kind == FILE:
            board_text(now, session.folder)
    except InputError as error:
        return str(error)
    if now.board_kind == "checkerboard" and not session.board:
        return "Grid points are the inner corners, where two black squares meet."
    return ""


def _options(fields: SettingFields) -> ui.select:
    """What is seldom changed; gives the choice of detectors."""
    located = {"none": "as found", "subpix": "OpenCV's search", "model": "a fit of the corner's image"}
    fields.option("preset", "Preset", {"": "none", "opencsp": "exactly as OpenCSP"})
    fields.option("board_shape", "Board shape", {name: name for name in ("auto", "flat", "warp", "free")})
    fields.line("pixel_aspect", "Pixel aspect", hint="free, square, or fy/fx")
    fields.option("weights", "Weights", DEFAULT | {"equal": "equal", "covariance": "by covariance"})
    fields.option("robust", "Leave out outlying corners", DEFAULT | {"yes": "yes", "no": "no"})
    detector = fields.option("detector", "Detector", DEFAULT)
    fields.option("refine", "Corners located by", DEFAULT | located)
    fields.line("guess", "Camera file to start from")
    fields.line("select", "Keep the N most telling views", "keep-views")
    fields.line("drop_worst", "Leave out the N worst views", "drop-worst")
    fields.line("max_rms", "Leave out views above rms (px)", "max-rms")
    fields.line("pixel_pitch_um", "Pixel size in µm")
    fields.text("notes", "Notes, one KEY=VALUE a line")
    return detector
