"""Asking before something is lost: a file that would be overwritten, a result that would be forgotten."""

from pathlib import Path

from nicegui import ui

from opencsp_calib.gui.session import Session

__all__ = ["may_forget", "may_write"]


async def may_write(path: Path) -> bool:
    """Whether a file, or files into a folder, may be written: there is none yet, or the person says so."""
    if not path.exists() or (path.is_dir() and not any(path.iterdir())):
        return True
    what = "Files in it that are called the same would be overwritten." if path.is_dir() else "It would be overwritten."
    return await _agreed(f"{path.name} is there already.", f"{what} That cannot be undone.", "Keep it", "Overwrite")


async def may_forget(session: Session) -> bool:
    """Whether photographs and results may make place for others: nothing is calibrated yet, or the person says so.

    Nor does work with them go on, which another page may have begun while the person was asked.
    """
    agreed = True
    if session.calibration is not None:
        title = f"The result for {session.calibration.camera.name} would be forgotten."
        agreed = await _agreed(title, "Files that were saved stay as they are.", "Keep it", "Forget it")
    if agreed and session.busy:
        session.say("Wait until what goes on is done, or cancel it.", "bad")
        return False
    return agreed


async def _agreed(title: str, text: str, no: str, yes: str) -> bool:
    with ui.dialog() as dialog, ui.card().classes("ask"):
        ui.label(title).classes("title")
        ui.label(text)
        with ui.element("div").classes("with-button"):
            ui.button(no, on_click=lambda: dialog.submit(False)).props("no-caps flat autofocus")
            ui.button(yes, on_click=lambda: dialog.submit(True)).props("no-caps unelevated color=negative")
    answer = await dialog
    dialog.delete()
    return bool(answer)
