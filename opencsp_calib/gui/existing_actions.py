"""What can be done with an existing camera: check, compare, convert, undistort, solve again."""

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nicegui import ui

from opencsp_calib.camera import Camera
from opencsp_calib.camera_files import CameraFile, convert, read_camera_file, write_camera_file
from opencsp_calib.comparison import compare
from opencsp_calib.counted import counted
from opencsp_calib.errors import CalibError, InputError
from opencsp_calib.gui.asking import may_forget, may_write
from opencsp_calib.gui.controls import choice, field, offer, quiet_action
from opencsp_calib.gui.drawn import DRAWING
from opencsp_calib.gui.files import shown, with_ending, within
from opencsp_calib.gui.kept import take_up
from opencsp_calib.gui.news import Message
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.registry import installed

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["ACTIONS", "Chosen"]

FORMATS = {"": "by the name's ending", "opencsp": "OpenCSP (HDF5)"}
LEVELS = {"ok": "good", "degraded": "doubt", "wrong": "bad"}


@dataclass
class Chosen:
    """The camera file that is open, by which arguments of `read_camera_file`, and where answers about it go."""

    asked: Mapping[str, Any] | None = None
    file: CameraFile | None = None
    answer: ui.html | None = None

    def tell(self, html: str) -> None:
        """Show an answer."""
        if self.answer is not None:
            self.answer.set_content(html)

    @property
    def opened(self) -> CameraFile:
        """The file; an InputError where none is open."""
        if self.file is None:
            raise InputError("open a camera file first")
        return self.file


Refresh = Callable[[], None]


def _check(page: "Page", chosen: Chosen) -> Refresh:
    session = page.session

    async def work() -> None:
        found: dict[str, Any] = await session.job(
            "check",
            camera=chosen.asked,
            images=[str(file.path) for file in session.selection.files],
            board=session.board,
        )
        level = LEVELS[found["verdict"]]
        reasons = "".join(f"<li>{escape(reason)}</li>" for reason in found["reasons"])
        sentence = f"{found['name']}: {found['verdict']}"
        chosen.tell(f'<div class="verdict {level}">{escape(sentence)}</div><ul class="warnings">{reasons}</ul>')
        session.message = Message(f"Checked: {sentence}", "good" if level == "good" else "bad")

    ui.html("<h2>Check against photographs</h2>", sanitize=False)
    ui.label("Takes the photographs and the board under Calibrate.").classes("hint")
    button = quiet_action("Check", lambda: session.start("Checking", work), "check-camera")

    def refresh() -> None:
        button.set_enabled(chosen.file is not None and bool(session.selection.files) and not session.busy)

    return refresh


def _compare(page: "Page", chosen: Chosen) -> Refresh:
    session = page.session

    def compared(other_camera: Camera, range_m: float | None) -> str:
        from opencsp_calib.report.figures import as_image
        from opencsp_calib.report.plots import difference_plot

        found = compare(chosen.opened.camera, other_camera, range_m=range_m)
        return f"<h2>Compared</h2><p>{escape(str(found))}</p>" + as_image(difference_plot(found), str(found))

    async def run() -> None:
        try:
            if other.value.strip():
                camera = read_camera_file(within(session.folder, other.value), which.value or None).camera
            elif session.calibration:
                camera = session.calibration.camera
            else:
                raise InputError("name another camera file, or calibrate first")
            range_m = float(distance.value) if distance.value.strip() else None
            session.say("Comparing …")
            told = await asyncio.get_running_loop().run_in_executor(DRAWING, compared, camera, range_m)
        except ValueError:
            session.say(f"The range is a number of metres, not {distance.value!r}.", "bad")
        except CalibError as error:
            session.say(str(error), "bad")
        else:
            chosen.tell(told)
            session.say("Compared.", "good")

    ui.html("<h2>Compare</h2>", sanitize=False)
    other = field("Other file; empty: the result here", "", lambda _: None, "compare-with")
    which = field("Which of several cameras in it", "", lambda _: None, "compare-which")
    distance = field("Range in m; empty: at infinity", "", lambda _: None)
    return _needs_file(quiet_action("Compare", run, "compare-cameras"), chosen)


def _convert(page: "Page", chosen: Chosen) -> Refresh:
    session = page.session

    async def run() -> None:
        try:
            endings = installed().camera_formats[form.value].extensions if form.value else ()
            path = within(session.folder, with_ending(place.value.strip() or "converted", endings))
            if path.is_dir():
                raise InputError("name the file to write")
            accepted = float(accept.value) if accept.value.strip() else None
            session.say("Converting …")
            made = await asyncio.to_thread(convert, chosen.opened, fit.value or None, accepted)
            if await may_write(path):
                write_camera_file(made.camera, path, form.value or None, made.record)
                said = f" ({made.record['import fit']})" if made.fit else ""
                session.say(f"Camera saved: {shown(session.folder, path)}{said}", "good")
            else:
                session.say(f"{shown(session.folder, path)} is as it was.")
        except ValueError:
            session.say("The accepted error is a number of pixels.", "bad")
        except CalibError as error:
            session.say(str(error), "bad")

    ui.html("<h2>Convert</h2>", sanitize=False)
    form = choice("Format", FORMATS, "", lambda _: None)
    fit = choice("Lens model", {"": "exactly as it is", **{m: f"fit {m}" for m in LENS_MODELS}}, "", lambda _: None)
    accept = field("Accepted error of a fit in px", "", lambda _: None, hint="0.1")
    place = field("Save as", "", lambda _: None, "convert-to", "camera.yaml")
    enable = _needs_file(quiet_action("Convert", run, "convert-camera"), chosen)

    def refresh() -> None:
        if session.offered:
            offer(form, FORMATS | session.offered.formats)
        enable()

    return refresh


def _solve_again(page: "Page", chosen: Chosen) -> Refresh:
    session = page.session

    def solve_again() -> None:
        take_up(session, chosen.opened.path)
        page.show_tab("Calibrate")

    async def run() -> None:
        if await may_forget(session):
            page.attempt(solve_again)

    ui.html("<h2>Solve again</h2>", sanitize=False)
    ui.label("Takes the corners kept in the file to Calibrate, to be solved in another way.").classes("hint")
    button = quiet_action("Solve again", run, "solve-again")

    def refresh() -> None:
        button.set_enabled(chosen.file is not None and chosen.file.calibration is not None and not session.busy)

    return refresh


def _undistort(page: "Page", chosen: Chosen) -> Refresh:
    session = page.session

    async def work(folder: Path) -> None:
        images = [str(file.path) for file in session.selection.files]
        await session.job("undistort", camera=chosen.asked, images=images, folder=str(folder))
        session.message = Message(f"{counted(len(images), 'image')} saved in {shown(session.folder, folder)}", "good")

    async def run() -> None:
        try:
            folder = within(session.folder, place.value.strip() or "undistorted")
        except CalibError as error:
            session.say(str(error), "bad")
            return
        if await may_write(folder):
            session.start("Undistorting", partial(work, folder))

    ui.html("<h2>Undistort photographs</h2>", sanitize=False)
    ui.label("Takes the photographs under Calibrate, as a pinhole camera would have taken them.").classes("hint")
    place = field("Into the folder", "", lambda _: None, hint="undistorted")
    button = quiet_action("Undistort", run, "undistort")

    def refresh() -> None:
        button.set_enabled(chosen.file is not None and bool(session.selection.files) and not session.busy)

    return refresh


def _needs_file(button: ui.button, chosen: Chosen) -> Refresh:
    def refresh() -> None:
        button.set_enabled(chosen.file is not None)

    return refresh


ACTIONS = (_check, _compare, _convert, _undistort, _solve_again)
