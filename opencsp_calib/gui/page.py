"""The page: header, the steps on the left in the order of use, what was found on the right, the status below.

How a section is added: write a file with a function ``build(page)`` that makes its elements and returns a function
without arguments which brings them up to date with ``page.session``; it is called whenever the session changes. Put it
into `STEPS` (left), `RESULTS` (right, shown one at a time) or `TABS` (a tab of its own beside Calibrate) below; what is
in the last two is not built with the page: a tab right after it is there, a result when it is first shown. A section
changes nothing itself: it calls a method of the session, which tells every page.
"""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from importlib.resources import files
from typing import TypeAlias

from nicegui import ui
from nicegui.element import Element

from opencsp_calib.errors import CalibError
from opencsp_calib.gui import (
    about,
    board_fields,
    calibrating,
    capturing,
    corners,
    cross_validation,
    existing,
    fleets,
    photographs,
    poses,
    printing,
    report_sections,
    reprojection,
    saving,
    status,
    viewer,
    views,
)
from opencsp_calib.gui.controls import Part
from opencsp_calib.gui.panels import Panels
from opencsp_calib.gui.session import Session

__all__ = ["Page", "show"]

Refresh: TypeAlias = Callable[[], None]
Build: TypeAlias = Callable[["Page"], Refresh]

STEPS: tuple[tuple[str, Build], ...] = (
    ("Camera and board", board_fields.build),
    ("Photographs", photographs.build),
    ("Corners", corners.build),
    ("Calibration", calibrating.build),
    ("Save", saving.build),
)
RESULTS: tuple[tuple[str, Build], ...] = (
    ("Photographs", views.build),
    ("Found corners", viewer.build),
    ("Result", report_sections.result),
    ("Reprojection error", reprojection.build),
    ("Distortion", report_sections.distortion),
    ("Poses", poses.build),
    ("Board shape", report_sections.board_shape),
    ("Uncertainty", report_sections.uncertainty),
    ("Cross-validation", cross_validation.build),
)
TABS: tuple[tuple[str, Build], ...] = (
    ("Capture", capturing.build),
    ("Existing camera", existing.build),
    ("Many cameras", fleets.build),
    ("Print a board", printing.build),
    ("About", about.build),
)
BEFORE_CALIBRATION = ("Photographs", "Found corners")


class ColoursButton(Element, component="colours.js"):
    """The button for the page's colours; see the component."""


class Page:
    """What one tab of a browser shows of the session."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.image = ""
        """The photograph that is looked at."""
        self.selected: set[str] = set()
        """Photographs that are selected in the tables, to be removed or put back."""
        self._refreshers: dict[str, Refresh] = {}
        self._seldom: dict[str, Refresh] = {}
        self._always: list[Refresh] = []
        self._connected = False

    def show_result(self, name: str) -> None:
        """Bring one of `RESULTS` to the front."""
        self._results.set_value(name)

    @property
    def tab(self) -> str:
        """Which tab is shown: ``Calibrate``, or one of `TABS`."""
        return str(self._pages.value)

    def show_tab(self, name: str) -> None:
        """Bring a tab to the front."""
        self._pages.set_value(name)

    def look_at(self, image: str) -> None:
        """Open a photograph with its corners."""
        if self.session.observations and image in {view.image for view in self.session.observations.views}:
            self.image = image
            self.show_result("Found corners")
            self.refresh()

    def attempt(self, action: Callable[[], None]) -> None:
        """Do what a person asked for; what is wrong with it goes into the status."""
        try:
            action()
        except CalibError as error:
            self.session.say(str(error), "bad")

    def build(self) -> None:
        """Make all elements."""
        with Part("header").classes("head"):
            ui.label("Camera calibration").classes("title")
            ui.label(str(self.session.folder)).classes("quiet path")
            with ui.tabs().props("no-caps dense inline-label").classes("pages") as self._pages:
                for name in ("Calibrate", *dict(TABS)):
                    ui.tab(name)
            ColoursButton()
        panels = Panels(self._pages)
        with panels.add("Calibrate", "columns"):
            self._build_calibrate()
        for name, build in TABS:
            self._seldom[name] = self._when_shown(panels.add(name, "page"), build)
        self._pages.on_value_change(self.refresh)
        with Part("footer").classes("foot"):
            self._always.append(status.build(self))

    def _build_calibrate(self) -> None:
        with ui.element("div").classes("steps"):
            for number, (title, build) in enumerate(STEPS, start=1):
                with Part("section").classes("step"):
                    ui.html(f"<h2><span>{number}</span>{title}</h2>", sanitize=False)
                    self._always.append(build(self))
        with Part("main").classes("results"):
            with Part("div"), ui.tabs().props("no-caps dense align=left").classes("result-tabs") as self._results:
                self._tabs = {name: ui.tab(name) for name, _ in RESULTS}
            panels = Panels(self._results)
            for name, build in RESULTS:
                self._refreshers[name] = self._when_shown(panels.add(name, "result"), build)
            self._results.on_value_change(self.refresh)

    def _when_shown(self, panel: Part, build: Build) -> Refresh:
        """Build a section when it is first refreshed, so that the page does not wait for what is not seen."""
        built: list[Refresh] = []

        def refresh() -> None:
            if not built:
                with panel:
                    built.append(build(self))
            built[0]()

        return refresh

    async def connected(self) -> None:
        """Make ready what need not wait until it is asked for; later, make good what was lost with the connection."""
        if self._connected:
            await self._send_again()
            return
        self._connected = True
        await self.session.ask_plugins()
        # what the browser makes of these would come while both cores look for corners
        for refresh in (*map(self._refreshers.__getitem__, BEFORE_CALIBRATION), *self._seldom.values()):
            refresh()
            await asyncio.sleep(0)  # other pages are answered meanwhile

    async def _send_again(self) -> None:
        """Send every element as it is now.

        After a connection is lost NiceGUI repeats what may not have arrived, but after what is newer: a line that has
        changed meanwhile would keep its old words.
        """
        client = ui.context.client
        with suppress(TimeoutError):
            await client.run_javascript("return 0", timeout=60)  # answered when all that is repeated has arrived
        for element in list(client.elements.values()):
            element.update()

    def refresh(self) -> None:
        """Bring what can be seen up to date."""
        for refresh in self._always:
            refresh()
        for name, tab in self._tabs.items():
            tab.set_enabled(name in BEFORE_CALIBRATION or self.session.calibration is not None)
        self._refreshers[str(self._results.value)]()
        if self._pages.value in self._seldom:
            self._seldom[self._pages.value]()


def show(session: Session) -> None:
    """Build the page for one more tab of a browser."""
    ui.colors(primary="#0b6e99", positive="#1c7c4a", negative="#b3261e", warning="#9a6200")
    ui.add_css(f".report {{ {_style('report')} }} {_style('gui')}")
    ui.add_body_html("<script>history.replaceState(null, '', location.pathname + location.hash)</script>")
    page = Page(session)
    page.build()
    page.refresh()
    session.changed.subscribe(page.refresh)
    ui.context.client.on_connect(page.connected)


def _style(package: str) -> str:
    return (files("opencsp_calib") / package / "style.css").read_text(encoding="utf-8")
