"""Asking before a file is overwritten."""

from pathlib import Path

from nicegui import ui

__all__ = ["may_write"]


async def may_write(path: Path) -> bool:
    """Whether a file may be written: there is none yet, or the person says so."""
    if not path.exists():
        return True
    with ui.dialog() as dialog, ui.card().classes("ask"):
        ui.label(f"{path.name} is there already.").classes("title")
        ui.label("Overwriting it cannot be undone.")
        with ui.element("div").classes("with-button"):
            ui.button("Keep it", on_click=lambda: dialog.submit(False)).props("no-caps flat autofocus")
            ui.button("Overwrite", on_click=lambda: dialog.submit(True)).props("no-caps unelevated color=negative")
    answer = await dialog
    dialog.delete()
    return bool(answer)
