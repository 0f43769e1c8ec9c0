"""The tab Capture in a browser, with Basler's emulated camera: from the live picture straight on to a calibration."""

import json
import shutil
import time
from datetime import datetime
from pathlib import Path

import pytest
from gui_window import Window

pytest.importorskip("pypylon", reason="Basler's SDK is not installed")
pytestmark = pytest.mark.timeout(1200)

COPIES = 6  # frames for which a board is held still
FRAMES_A_SECOND = 3


@pytest.fixture
def scene(photographs: Path, tmp_path: Path) -> Path:
    """Photographs of a board that is held still in twelve places, one after the other."""
    for photograph in photographs.glob("*.png"):
        for copy in range(COPIES):
            shutil.copyfile(photograph, tmp_path / f"{photograph.stem}_{copy}.png")
    return tmp_path


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
    settings = f"ImageFilename={scene}\nImageFileMode=On\nTestImageSelector=Off"
    settings += f"\nAcquisitionFrameRate={FRAMES_A_SECOND}"
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
    for _ in range(3):
        before = taken(window)
        window.browser.find_element("css selector", "body").send_keys(" ")
        window.until(lambda before=before: taken(window) > before)
        time.sleep(COPIES / FRAMES_A_SECOND)  # the board is elsewhere
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
    for name, wrong, words in (
        ("capture-device", "/", "outside of"),
        ("capture-goal", "none", "goal must be a positive number"),
        ("capture-range", "-1", "working distance must be a positive number"),
    ):
        right = window.element(name).get_attribute("value")
        window.type(name, wrong)
        window.until(lambda: window.enabled("capture-start"))
        window.click("capture-start")
        window.until(lambda words=words: words in window.status)
        window.type(name, right)
    window.type("capture-device", "4711")
    window.until(lambda: window.enabled("capture-start"))
    window.click("capture-start")
    window.until(lambda: "no Basler camera '4711'" in window.element("capture-message").text)
    window.until(lambda: window.element("capture-start").is_displayed())


def test_a_photograph_every_two_seconds(window: Window) -> None:
    """The camera's own test picture will do: nobody asks for a board in it."""
    window.describe("captured", 9, 6, 30)
    open_tab(window)
    window.type("capture-folder", "every-two-seconds")
    window.choose("Release", "every two seconds")
    window.type("capture-count", "2")
    window.until(lambda: window.enabled("capture-start"))
    start(window)
    window.until(lambda: "photographs are taken" in window.element("capture-message").text)
    folder = window.server.folder / "every-two-seconds"
    first, second = (json.loads((folder / name).read_text())["time"] for name in ("0001.json", "0002.json"))
    assert (datetime.fromisoformat(second) - datetime.fromisoformat(first)).total_seconds() > 1.9
