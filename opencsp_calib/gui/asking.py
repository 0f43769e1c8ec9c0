"""Asking before a file is overwritten, or files in a folder may be."""

from pathlib import Path

from nicegui import ui

__all__ = ["may_write"]


async def may_write(path: Path) -> bool:
    """Whether a file, or files into a folder, may be written: there is none yet, or the person says so."""
    if not path.exists() or (path.is_dir() and not any(path.iterdir())):
        return True
    what = "Files in it that are called the same would be overwritten." if path.is_dir() else "It would be overwritten."
    with ui.dialog() as dialog, ui.card().classes("ask"):
        ui.label(f"{path.name} is there already.").classes("title")
        ui.label(f"{what} That cannot be undone.")
        with ui.element("div").classes("with-button"):
            ui.button("Keep it", on_click=lambda: dialog.submit(False)).props("no-caps flat autofocus")
            ui.button("Overwrite", on_click=lambda: dialog.submit(True)).props("no-caps unelevated color=negative")
    answer = await dialog
    dialog.delete()
    return bool(answer)
