"""A camera that exists already, in any format: show it, check it against photographs, compare, convert, undistort."""

from collections.abc import Callable
from html import escape
from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.element import Element
from nicegui.events import GenericEventArguments

from opencsp_calib.camera_files import CameraFile, read_camera_file
from opencsp_calib.errors import CalibError
from opencsp_calib.gui import existing_actions as actions
from opencsp_calib.gui.controls import field
from opencsp_calib.gui.files import shown, within
from opencsp_calib.gui.wording import worded
from opencsp_calib.judgement import judge
from opencsp_calib.summary import parameter_lines

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


class CameraInput(Element, component="camera_file.js"):
    """Where a camera file comes in; see the component."""


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    chosen = actions.Chosen()
    with ui.element("div").classes("two"):
        with ui.element("div").classes("narrow"):
            ui.html("<h2>Existing camera</h2>", sanitize=False)
            entry = CameraInput()
            place = field("Camera file", "", lambda _: None, "camera-file", "camera.h5")
            with ui.expansion("Where the file does not tell").props("dense").classes("more") as more:
                name = field("Which of several cameras", "", lambda _: None, "which-camera")
                size = field("Image size, such as 1626x1236", "", lambda _: None)
                form = field("Format", "", lambda _: None)
            ui.button("Open", on_click=lambda: opened()).props("no-caps unelevated data-testid=open-camera").classes(
                "action"
            )
            refreshers = [build_action(page, chosen) for build_action in actions.ACTIONS]
        with ui.element("div"):
            told = ui.html("", sanitize=False).classes("report")
            chosen.answer = ui.html("", sanitize=False).classes("report")

    def read() -> None:
        path = within(session.folder, place.value)
        asked: dict[str, Any] = {
            "name": name.value or None,
            "format_name": form.value or None,
            "image_size": size.value or None,
        }
        file = read_camera_file(path, **asked)
        chosen.asked, chosen.file = {"path": str(path), **asked}, file
        told.set_content(_told(file))
        chosen.tell("")
        session.say(f"{shown(session.folder, path)} is open.")

    def opened() -> None:
        chosen.file = None
        page.attempt(read)
        if chosen.file is None:
            told.set_content("")
            more.open()  # most often it is a name or a size that is asked for
            page.refresh()

    def received(event: GenericEventArguments) -> None:
        if event.args["wrong"]:
            session.say(f"{event.args['name']} cannot be received: {event.args['wrong']}", "bad")
            return
        place.set_value(event.args["path"])
        opened()

    entry.on("received", received)
    place.on("keydown.enter", opened)

    def refresh() -> None:
        for one in refreshers:
            one()

    return refresh


def _told(file: CameraFile) -> str:
    """What ``show`` tells."""
    from opencsp_calib.report.html import table

    notes = [note.message for note in file.imported.notes]
    try:
        camera = file.camera
    except CalibError as error:
        return f'<h1>{escape(file.name)}</h1><div class="verdict doubt">{escape(worded(str(error)))}</div>'
    solved = file.calibration
    columns = ("parameter", "value", *(["± one standard deviation"] if solved else []))
    lines = [line[: len(columns)] for line in parameter_lines(camera, solved.sigma if solved else None, file.record)]
    size = " × ".join(map(str, camera.image_size))
    about = f"{camera.model}, {size} px"
    if solved:
        views = len(solved.observations.used)
        about += f", calibrated by {solved.solver} from {views} views, rms {solved.rms_px:.4f} px"
        notes += [problem.message for problem in judge(solved)]
    notes += [f"{key}: {value}" for key, value in file.record.items()]
    listed = "".join(f"<li>{escape(note)}</li>" for note in notes)
    return (
        f'<h1>{escape(camera.name)}</h1><div class="subtitle">{escape(about)}</div>'
        + (f'<ul class="warnings">{listed}</ul>' if listed else "")
        + table(columns, lines)
    )
