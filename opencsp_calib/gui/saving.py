"""Step 5: saving the camera, to a place below DIR and as a download."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from nicegui import ui

from opencsp_calib.gui.controls import action, field
from opencsp_calib.gui.files import file_name, within

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]


def build(page: "Page") -> Callable[[], None]:
    """See `page.py`."""
    session = page.session
    place = field("Save as, below DIR", "", lambda _: None, hint="camera.h5")
    download = ui.checkbox("Download it too", value=True)

    async def save() -> None:
        name = place.value.strip() or default()
        page.attempt(lambda: session.save_camera(target(name)))
        if download.value:
            ui.download.from_url("camera")

    def target(name: str) -> Path:
        return within(session.folder, name if Path(name).suffix else f"{name}.h5")

    def default() -> str:
        return file_name(session.settings.camera_name, "camera") + ".h5"

    button = action("Save Camera", save, "save-camera")

    def refresh() -> None:
        place.props["placeholder"] = default()
        button.set_enabled(session.calibration is not None and not session.busy)

    return refresh
