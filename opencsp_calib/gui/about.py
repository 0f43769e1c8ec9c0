"""What is installed: versions, what the plugins provide, and the camera file formats."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from nicegui import ui

from opencsp_calib.gui.drawn import drawn
from opencsp_calib.provenance import made_with
from opencsp_calib.registry import installed

if TYPE_CHECKING:
    from opencsp_calib.gui.page import Page

__all__ = ["build"]

KINDS = {
    "boards": "board",
    "detectors": "detector",
    "solvers": "solver",
    "image_sources": "image source",
}
YES = {True: "yes", False: ""}


def build(_: "Page") -> Callable[[], None]:
    """See `page.py`."""
    with ui.element("div").classes("about"):
        return drawn(lambda: "what is installed", _told)


def _told() -> str:
    from opencsp_calib.report.html import table

    known = installed()
    provided = [
        (kind, name, known.origins[kinds, name], one.missing() or "ready")
        for kinds, kind in KINDS.items()
        for name, one in sorted(getattr(known, kinds).items())
    ]
    formats = [
        (one.title, name, YES[one.reads], YES[one.writes], " ".join(one.models), one.missing() or "")
        for name, one in sorted(known.camera_formats.items(), key=lambda item: item[1].title.lower())
    ]
    versions = ", ".join(f"{name} {version}" for name, version in made_with().items() if name != "time")
    return (
        f"<h2>Versions</h2><p>{versions}</p><h2>Plugins</h2>"
        + table(("kind", "name", "plugin", "state"), provided)
        + "<h2>Camera files</h2>"
        + table(("program and file", "format", "read", "written", "lens models carried exactly", ""), formats)
    )
