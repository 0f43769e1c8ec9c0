"""Step 5: saving the camera, to a place below DIR and as a download: HDF5, the report, or another program's format."""

import asyncio
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import quote

from nicegui import ui

from opencsp_calib.atomic import check_writable, replacing
from opencsp_calib.camera_files import write_camera_file
from opencsp_calib.errors import CalibError, InputError
from opencsp_calib.gui.asking import may_write
from opencsp_calib.gui.controls import action, choice, field, offer, set_prop
from opencsp_calib.gui.files import file_name, shown, with_ending, within
from opencsp_calib.gui.news import Message
from opencsp_calib.gui.session import Session
from opencsp_calib.hdf5_reading import EXTENSIONS
from opencsp_calib.registry import installed

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

HDF5, REPORT = "hdf5", "report"
KINDS = {HDF5: "Camera file (HDF5)", REPORT: "Report (HTML)"}
ENDINGS = {HDF5: EXTENSIONS, REPORT: (".html", ".htm")}


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    kind = choice("What", KINDS, HDF5, lambda _: refresh())
    place = field("Save as", "", lambda _: None, "save-as", "camera.h5")

    def named(name: str) -> str:
        endings = ENDINGS.get(kind.value) or installed().camera_formats[kind.value].extensions
        return with_ending(name or file_name(session.settings.camera_name, "camera"), endings)

    async def save() -> None:
        try:
            path = within(session.folder, named(place.value.strip()))
            check_writable(path)
            if path in {file.path.resolve() for file in session.selection.files}:
                raise InputError(f"{path.name} is one of the photographs; give another name")
            if not await may_write(path):
                return
            if await session.start(f"Saving {path.name}", partial(_save, session, kind.value, path)) and download.value:
                ui.download.from_url(f"/files?path={quote(shown(session.folder, path))}")
        except CalibError as error:
            session.say(str(error), "bad")

    with ui.element("div").classes("in-a-row"):
        download = ui.checkbox("Download it too", value=True).props("dense")
        button = action("Save Camera", save, "save-camera")

    def refresh() -> None:
        if session.offered:
            offer(kind, KINDS | session.offered.formats)
        set_prop(place, "placeholder", named(""))
        button.set_enabled(session.calibration is not None and not session.busy)

    return refresh


async def _save(session: Session, kind: str, path: Path) -> None:
    calibration = session.calibration
    if calibration is None:
        raise InputError("calibrate first")
    if kind == HDF5:
        await asyncio.to_thread(_copy, session.file("calibration"), path)  # the very bytes that the worker wrote
    elif kind == REPORT:
        kept, before = session.file("calibration"), session.file("before") if session.before else ""
        await session.job("report", calibration=str(kept), before=str(before), target=str(path))
    else:
        await asyncio.to_thread(write_camera_file, calibration.camera, path, kind)
    what = "Report" if kind == REPORT else "Camera"
    session.message = Message(f"{what} saved: {shown(session.folder, path)}", "good")


def _copy(kept: Path, path: Path) -> None:
    with replacing(path) as temporary:
        shutil.copyfile(kept, temporary)
