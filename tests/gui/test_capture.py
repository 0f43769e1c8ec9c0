"""The tab Capture in a browser, with Basler's emulated camera: from the live picture straight on to a calibration."""

import os
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from gui_window import Server, Window
from worlds import SmallWorld

from opencsp_calib.images import write_image
from opencsp_calib.rendering import render

pytest.importorskip("pypylon", reason="Basler's SDK is not installed")
pytestmark = [pytest.mark.timeout(600), pytest.mark.usefixtures("emulated_cameras")]

COPIES = 6  # frames for which a board is held still


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Photographs of a board that is held still in twelve places, one after the other."""
    world, folder = SmallWorld.seeded(), tmp_path_factory.mktemp("scene")
    for place, pose in enumerate(world.poses):
        for copy in range(COPIES):
            image = render(world.camera, world.board, pose, rng=place * COPIES + copy, samples=2)
            write_image(image.pixels, folder / f"{place:02d}_{copy}.png")
    return folder


@pytest.fixture
def window(chromium, tmp_path: Path, monkeypatch) -> Iterator[Window]:
    monkeypatch.setitem(os.environ, "PYLON_CAMEMU", "1")
    (tmp_path / "work").mkdir()
    with Server(tmp_path / "work") as running:
        opened = Window(chromium, running)
        opened.open()
        yield opened


def open_tab(window: Window) -> None:
    window.browser.find_element("xpath", "//div[contains(@class,'q-tab')][normalize-space()='Capture']").click()
    window.until(lambda: window.element("capture-start").is_displayed())


def start(window: Window) -> None:
    """Click Start until it is gone: on a busy machine the page may still be moving under the first click."""

    def started() -> bool:
        button = window.element("capture-start")
        if button.is_displayed() and button.is_enabled():
            button.click()
        return not button.is_displayed()

    window.until(started)


def taken(window: Window) -> int:
    words = window.element("capture-known").text.split(" of ")
    return int(words[0]) if words[0] else 0


def test_from_the_live_picture_straight_to_a_calibration(window: Window, scene: Path) -> None:
    window.describe("captured", 9, 6, 30)
    open_tab(window)
    settings = f"ImageFilename={scene}\nImageFileMode=On\nTestImageSelector=Off\nAcquisitionFrameRate=2"
    window.element("capture-settings").send_keys(settings)
    window.until(lambda: window.enabled("capture-start"))
    start(window)
    window.until(lambda: taken(window) >= 2, 300)  # by the coach alone
    window.picture("capture-1-live")
    picture = window.element("capture-picture")
    assert picture.find_elements("css selector", "svg path, svg polygon")
    gauges = window.element("capture-gauges").text
    assert all(name in gauges for name in ("board", "tilt", "still", "sharp", "light", "size", "new"))
    assert window.element("capture-next").text.startswith("Next: ")
    for _ in range(4):
        before = taken(window)
        window.browser.find_element("css selector", "body").send_keys(" ")
        window.until(lambda before=before: taken(window) > before)
        time.sleep(COPIES / 2)  # the board is elsewhere
    folder = window.server.folder / "photographs"
    window.click("capture-delete")
    window.until(lambda: "taken" in window.element("capture-message").text)
    window.click("capture-stop")
    window.until(lambda: "photographs are taken" in window.element("capture-message").text)
    window.picture("capture-2-stopped")
    photographs = len(list(folder.glob("*.png")))
    window.click("capture-calibrate")
    window.until(lambda: window.status.startswith("Calibrated from"))
    assert int(window.status.split()[2]) <= photographs
    window.picture("capture-3-calibrated")


def test_a_camera_that_is_not_there_is_one_sentence(window: Window) -> None:
    window.describe("captured", 9, 6, 30)
    open_tab(window)
    window.type("capture-device", "4711")
    window.until(lambda: window.enabled("capture-start"))
    window.click("capture-start")
    window.until(lambda: "no Basler camera '4711'" in window.element("capture-message").text)
    window.until(lambda: window.element("capture-start").is_displayed())
