"""The window when things go wrong, or are left and taken up again."""

import stat
from pathlib import Path

import numpy as np
import pytest
from gui_window import Server, Window

from opencsp_calib.images import write_image

pytestmark = pytest.mark.timeout(1200)


def test_wrong_images_say_why(window: Window, photographs: Path, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("no image")
    (tmp_path / "empty.png").write_bytes(b"")
    write_image(np.full((480, 640), 90, np.uint8), tmp_path / "grey.png")
    write_image(np.full((200, 300), 90, np.uint8), tmp_path / "small.png")
    window.describe("small", 9, 6, 30)
    window.select([*sorted(photographs.glob("*.png"))[:4], *sorted(tmp_path.glob("*.*"))])
    window.until(lambda: window.enabled("find-corners"))
    window.find_corners()
    assert window.status == "The board is found in 4 of 8 photographs."
    # the table follows the status within half a second
    window.until(lambda: [row[2] for row in window.rows("images")].count("used") == 4)
    table = {row[1]: row for row in window.rows("images")}
    assert table["notes.txt"][2] == table["empty.png"][2] == "unreadable"
    assert "empty" in table["empty.png"][-1]
    assert table["grey.png"][2] == "no board"
    assert table["grey.png"][-1]
    assert table["small.png"][2] in ("wrong size", "no board")
    assert table["01.png"][2:4] == ["used", "54"]
    pictures = "return [...document.querySelectorAll('[data-testid=images] img')].map((img) => img.naturalWidth > 0)"
    window.until(lambda: window.browser.execute_script(pictures) == [True] * 6)  # of all that are images
    window.picture("wrong-images")
    window.click("view-corners")
    window.until(lambda: window.element("viewed").text.startswith("01.png"))
    body = window.browser.find_element("tag name", "body")
    for _ in range(4):
        body.send_keys("\ue014")  # right
    window.until(lambda: window.element("viewed").text == "empty.png (5 of 8)")
    body.send_keys("\ue012")  # left
    window.until(lambda: window.element("viewed").text == "04.png (4 of 8)")


def test_no_board_anywhere_and_a_board_that_is_none(window: Window, tmp_path: Path) -> None:
    for index in range(3):
        write_image(np.full((240, 320), 60 + index, np.uint8), tmp_path / f"{index}.png")
    window.describe("camera", 9, 6, 30)
    window.drop([tmp_path], "[data-testid=status]")  # beside the place for it, which moves as fields are filled in
    window.until(lambda: window.enabled("find-corners"))
    window.type("grid-x", "2")
    window.until(lambda: not window.enabled("find-corners"))
    window.until(lambda: window.text_is_there("at least 3 inner corners"))
    window.type("grid-x", "nine")
    window.until(lambda: window.text_is_there("whole number"))
    window.type("grid-x", "9")
    window.find_corners()
    assert window.status == "The board is found in 0 of 3 photographs."
    assert not window.enabled("calibrate")


def test_cancel_then_go_on(small: Window) -> None:
    small.server.hold_worker()
    small.click("find-corners")
    small.click("cancel")
    small.until(lambda: "stopped" in small.status)
    small.until(lambda: small.enabled("find-corners"))
    small.find_corners()
    assert small.status == "The board is found in 12 of 12 photographs."


def test_reload_in_the_middle_and_a_second_tab_lose_nothing(small: Window) -> None:
    browser, selected = small.browser, small.status
    small.click("find-corners")
    small.until(lambda: small.status != selected)  # what is clicked in the moment of leaving need not be heard
    browser.refresh()
    small.until(lambda: small.status)
    browser.execute_script("window.socket.io.engine.close()")  # the connection is lost; the page finds it again itself
    small.until(lambda: small.status.startswith("The board is found in 12 of 12"))
    assert small.element("camera-name").get_attribute("value") == "small"
    first = browser.current_window_handle
    browser.switch_to.new_window("tab")
    browser.get(small.server.root)  # by the cookie
    small.until(lambda: small.enabled("calibrate"))
    rms = small.calibrate()
    small.type("camera-name", "renamed")
    browser.find_element("css selector", "[aria-label^=Colours]").click()
    browser.refresh()
    small.until(lambda: small.find_all("[aria-label='Colours: dark']") and small.find_all(".body--dark"))
    browser.execute_script("localStorage.clear()")
    second = browser.current_window_handle
    browser.switch_to.window(first)
    small.until(lambda: small.rms == f"{rms:.4f} px")
    small.until(lambda: small.element("camera-name").get_attribute("value") == "renamed")
    browser.switch_to.window(second)
    browser.close()
    browser.switch_to.window(first)


def test_what_was_lost_with_the_connection_comes_again(window: Window) -> None:
    """What changes while nobody hears it, before and after the connection is known to be lost."""
    browser = window.browser
    first = browser.current_window_handle
    browser.switch_to.new_window("tab")
    second = browser.current_window_handle
    browser.get(window.server.root)
    window.until(lambda: browser.execute_script("return window.did_handshake"))

    def change_it_elsewhere(name: str) -> None:
        browser.switch_to.window(second)
        window.type("photograph-folder", name)
        window.press("Use")
        window.until(lambda: name in window.status)
        browser.switch_to.window(first)

    browser.switch_to.window(first)
    browser.execute_script("window.socket.io.engine.transport.ws.onmessage = () => {}")
    change_it_elsewhere("older")
    browser.execute_script("window.socket.io.reconnection(false); window.socket.io.engine.close()")
    change_it_elsewhere("newer")
    again = "manager.reconnection(true); manager.skipReconnect = false; manager.reconnect()"
    browser.execute_script(f"const manager = window.socket.io; {again}")
    window.until(lambda: "newer" in window.status)
    browser.switch_to.window(second)
    browser.close()
    browser.switch_to.window(first)


def test_a_place_that_cannot_be_written(calibrated: Window) -> None:
    folder = calibrated.server.folder
    (folder / "taken.h5").mkdir()
    for place, words in (
        ("no/such/camera.h5", "does not exist"),
        ("taken.h5", "is a folder"),
        ("../out.h5", "outside of"),
    ):
        calibrated.type("save-as", place)
        calibrated.click("save-camera")
        calibrated.until(lambda words=words: words in calibrated.status)
    assert not list(folder.glob("*.h5/*"))
    calibrated.type("save-as", "camera.h5")
    calibrated.click("save-camera")
    calibrated.until(lambda: calibrated.status == "Camera saved: camera.h5")
    written = (folder / "camera.h5").read_bytes()
    calibrated.click("save-camera")
    calibrated.until(lambda: calibrated.text_is_there("is there already"))
    calibrated.picture("overwrite")
    calibrated.press("Keep it")
    calibrated.until(lambda: calibrated.enabled("save-camera"))
    assert (folder / "camera.h5").read_bytes() == written
    assert stat.S_ISREG((folder / "camera.h5").stat().st_mode)


def test_tomorrow_it_goes_on_from_here(
    chromium: object, photographs: Path, tmp_path: Path, tmp_path_factory: pytest.TempPathFactory
) -> None:
    with Server(tmp_path) as server:
        window = Window(chromium, server)
        window.open()
        window.describe("small", 9, 6, 30)
        window.select(sorted(photographs.glob("*.png")))
        window.until(lambda: window.enabled("find-corners"))
        window.find_corners()
        rms = window.calibrate()
        window.leave()
    assert (server.more_output, server.errors) == ("", "")  # one address was printed, and nothing else
    assert {path.name for path in tmp_path.iterdir()} == {"opencsp-calib-session"}
    without = tmp_path_factory.mktemp("without_pypylon")
    (without / "sitecustomize.py").write_text("import sys; sys.modules['pypylon'] = None")
    with Server(tmp_path, PYTHONPATH=str(without)) as server:
        window = Window(chromium, server)
        window.open()
        assert window.rms == f"{rms:.4f} px"
        assert [window.element(name).get_attribute("value") for name in ("grid-x", "grid-y")] == ["9", "6"]
        assert window.enabled("calibrate")
        window.until(lambda: len(window.rows("images")) == 12)
        window.tab("Capture")  # here without Basler's SDK
        window.until(lambda: "pip install 'opencsp-calib[basler]'" in window.element("capture-lacking").text)
        assert not window.enabled("capture-start")
        window.leave()
