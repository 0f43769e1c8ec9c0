"""The tab Capture: the live picture with corners and the next view drawn in it, gauges, and the shutter."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import ui
from nicegui.events import KeyEventArguments

from opencsp_calib.errors import InputError
from opencsp_calib.gui.asking import may_forget
from opencsp_calib.gui.controls import Part, action, choice, field, quiet_action
from opencsp_calib.gui.files import within
from opencsp_calib.gui.live_capture import SHOWN_PX, LiveCapture
from opencsp_calib.gui.procedure import find_and_calibrate
from opencsp_calib.gui.wording import worded
from opencsp_calib.information import GOAL_PX
from opencsp_calib.registry import installed

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

RELEASES = {"coach": "when the coach finds it right", "manual": "by hand", "interval:2": "every two seconds"}
MARKS = {"good": "✓", "bad": "✗", "unknown": "?"}
NOTHING = "data:image/svg+xml,<svg xmlns='http://www.w3.org/2000/svg' width='960' height='720'/>"


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    live = page.session.capture
    with ui.element("div").classes("columns capture"):
        with Part("div").classes("steps"):
            refresh_controls = _controls(page, live)
        with Part("main").classes("results live"):
            refresh_picture = _picture(live)
        with Part("div").classes("told"):
            refresh_gauges = _gauges(live)

    def refresh() -> None:
        refresh_controls()
        refresh_gauges()
        refresh_picture()

    live.changed.subscribe(refresh)
    return refresh


def _controls(page: "Page", live: LiveCapture) -> Callable[[], None]:
    asked = {"source": "basler", "device": "", "release": "coach", "count": "50", "folder": "photographs", "set": ""}
    asked |= {"goal": f"{GOAL_PX:g}", "range": ""}

    def take(name: str) -> Callable[[str], None]:
        return lambda value: asked.update({name: value})

    def take_source(value: str) -> None:
        asked["source"] = value
        refresh()

    async def start() -> None:
        try:
            folder = within(page.session.folder, asked["folder"])
            device = _device(page.session.folder, asked["device"])
            count = _number(asked["count"])
            goal_px = _positive(asked["goal"], "goal", "0.1")
            range_m = _positive(asked["range"], "working distance", "5") if asked["range"].strip() else None
        except InputError as error:
            page.session.say(str(error), "bad")
            return
        await live.start(
            folder=str(folder),
            board=page.session.board,
            source=asked["source"],
            device=device or None,
            release=asked["release"],
            count=count,
            range_m=range_m,
            goal_px=goal_px,
            settings=[line.strip() for line in asked["set"].splitlines() if line.strip()],
        )

    def on_key(event: KeyEventArguments) -> None:
        if event.action.keydown and not event.action.repeat and event.key.space and page.tab == "Capture":
            live.order("press")

    ui.keyboard(on_key=on_key)
    with ui.element("section").classes("step"):
        known = installed().image_sources
        choice("Images from", {name: name for name in sorted(known)}, asked["source"], take_source)
        lacking = ui.label().classes("hint").props("data-testid=capture-lacking")
        field("Camera (serial number) or folder", "", take("device"), "capture-device", "the first camera")
        field("Photographs go to the folder", asked["folder"], take("folder"), "capture-folder")
        choice("Release", RELEASES, asked["release"], take("release")).props("data-testid=capture-release")
        field("Photographs in all", asked["count"], take("count"), "capture-count")
        with ui.element("div").classes("side-by-side"):
            field("Goal in px", asked["goal"], take("goal"), "capture-goal")
            field("Distance in m", "", take("range"), "capture-range", "far")
        settings = ui.textarea("Camera settings", on_change=lambda e: asked.update(set=e.value)).classes("field")
        settings.props('outlined dense autogrow data-testid=capture-settings placeholder="FEATURE=VALUE, one a line"')
        begin = action("Start", start, "capture-start")
        end = quiet_action("Stop", lambda: live.order("stop"), "capture-stop")
        with ui.element("div").classes("side-by-side"):
            press = quiet_action("Release", lambda: live.order("press"), "capture-release-now")
            delete = quiet_action("Delete last", lambda: live.order("delete"), "capture-delete")
        keys = ui.label("The space bar releases too.").classes("hint")
        on = action("Calibrate these", lambda: _calibrate(page, asked["folder"]), "capture-calibrate")

    def refresh() -> None:
        begin.set_visibility(not live.running)
        missing = known[asked["source"]].missing() if asked["source"] in known else "no installed plugin provides it"
        lacking.set_text(f"{asked['source']}: {missing}" if missing else "")
        lacking.set_visibility(missing is not None)
        begin.set_enabled(bool(page.session.board) and missing is None)
        for shown in (end, press, delete, keys):
            shown.set_visibility(live.running)
        taken = bool(live.frame and live.frame["taken"])
        on.set_enabled(taken and not live.running and not page.session.busy)

    return refresh


async def _calibrate(page: "Page", folder: str) -> None:
    """Go on with the photographs in a folder."""

    def go_on() -> None:
        page.session.forget_photographs()
        page.session.selection.add(folder)
        find_and_calibrate(page.session)
        page.show_tab("Calibrate")

    if await may_forget(page.session):
        page.attempt(go_on)


def _device(folder: Path, text: str) -> str:
    """A camera's serial number as it is; a folder only below DIR, its whole path."""
    is_folder = (folder / Path(text.strip()).expanduser()).is_dir()
    return str(within(folder, text)) if text.strip() and is_folder else text.strip()


def _positive(text: str, what: str, such_as: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not 0 < value < math.inf:
        raise InputError(f"the {what} must be a positive number, such as {such_as}, not {text!r}")
    return value


def _number(text: str) -> int:
    if not (text.strip().isdecimal() and int(text) > 0):
        raise InputError(f"the number of photographs must be a whole number, such as 50, not {text!r}")
    return int(text)


def _gauges(live: LiveCapture) -> Callable[[], None]:
    with ui.element("div") as told:
        with ui.element("section").classes("step"):
            table = ui.html(sanitize=True).classes("gauges").props("data-testid=capture-gauges")
        with ui.element("section").classes("step"):
            known = ui.label().classes("value").props("data-testid=capture-known")
            bar = ui.linear_progress(value=0.0, show_value=False, size="6px").props("rounded aria-label=Progress")
            following = ui.label().classes("hint").props("data-testid=capture-next")
            missing = ui.label().classes("hint missing").props("data-testid=capture-missing")

    def refresh() -> None:
        frame = live.frame
        told.set_visibility(frame is not None)
        if frame is None:
            return
        table.set_content("".join(_row(*gauge) for gauge in frame["gauges"]))
        sigma = f"{frame['sigma_px']:.2g} px, goal {frame['goal_px']:g}" if frame["sigma_px"] else frame["why_not"]
        known.set_text(f"{frame['taken']} of {frame['count']}: {sigma}")
        bar.set_value(frame["progress"])
        following.set_text(f"Next: {frame['next']}" if frame["next"] else "")
        missing.set_text("\n".join(f"Missing: {lack}" for lack in frame["lacks"]))

    return refresh


def _row(name: str, state: str, value: str) -> str:
    return f'<div class="gauge {state}"><b>{MARKS[state]}</b><span>{name}</span><span>{value}</span></div>'


def _picture(live: LiveCapture) -> Callable[[], None]:
    advice = ui.label().classes("advice").props("data-testid=capture-advice role=status aria-live=polite")
    picture = ui.interactive_image(NOTHING, cross=False, sanitize=False).classes("live-picture")
    picture.props("data-testid=capture-picture")
    said = ui.label().props("data-testid=capture-message")

    def refresh() -> None:
        said.set_text(worded(live.message.text))
        said.classes(replace=f"status {live.message.level}")
        frame = live.frame
        if frame is None:
            advice.set_text("")
            return
        advice.set_text(frame["advice"])
        picture.set_source(f"data:image/jpeg;base64,{frame['picture']}")
        picture.set_content(_drawn(frame))
        width, height = frame["size"]
        picture.style(f"--aspect: {width / height:.4f}")

    return refresh


def _drawn(frame: dict[str, Any]) -> str:
    """Corners found, and the outline of the next view, in pixels of the picture as it is shown."""
    width, height = frame["size"]
    scale = min(1.0, SHOWN_PX / max(width, height))

    def at(x: float, y: float) -> str:
        return f"{(x + 0.5) * scale - 0.5:.1f},{(y + 0.5) * scale - 0.5:.1f}"

    outline = " ".join(at(x, y) for x, y in frame["outline"])
    dots = "".join(f"M{at(x, y)} m-4,0 h8 m-4,-4 v8" for x, y in frame["corners"])
    return (
        f'<polygon points="{outline}" fill="none" stroke="#ffb000" stroke-width="3" stroke-dasharray="10 6"/>'
        f'<path d="{dots}" stroke="#35d07f" stroke-width="2" fill="none"/>'
    )
