"""The window when things go wrong, or are left and taken up again; who is let in; what else can be done."""

import http.client
import socket
import stat
from pathlib import Path
from urllib.parse import urlsplit

import numpy as np
import pytest
from gui_window import Server, Window, run_cli
from worlds import SmallWorld

from opencsp_calib import Camera
from opencsp_calib.camera_files import write_camera_file
from opencsp_calib.images import write_image

pytestmark = pytest.mark.timeout(300)


# --- who is let in ----------------------------------------------------------------------------------------------------


def answer(server: Server, path: str, method: str = "GET", **headers: str) -> int:
    """The status of a request without the browser's cookie."""
    where = urlsplit(server.address)
    connection = http.client.HTTPConnection(where.hostname or "", where.port or 0, timeout=30)
    connection.request(method, path, headers=headers)
    status = connection.getresponse().status
    connection.close()
    return status


def test_only_who_has_the_token_is_let_in(server: Server) -> None:
    token = urlsplit(server.address).query
    home, own = f"/?{token}", urlsplit(server.address).netloc
    socket_path = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    upgrade = {"Connection": "Upgrade", "Upgrade": "websocket", "Sec-WebSocket-Version": "13"}
    upgrade |= {"Sec-WebSocket-Key": "x3JJHMbDL1EzLkh9GBhXDw=="}
    assert answer(server, home) == 200
    assert answer(server, home, Origin=f"http://{own}") == 200
    for path in ("/", "/?token=wrong", "/?token=", "/photographs?image=x", "/files?path=x", "/nothing", socket_path):
        assert answer(server, path) == 403, path
    assert answer(server, socket_path, **upgrade) == 403
    for host in ("evil.example", f"evil.example:{urlsplit(own).port}", "127.0.0.1.evil.example", "", "[", "10.0.0.1"):
        assert answer(server, home, Host=host) == 403, host
    for origin in ("http://evil.example", "null", f"https://evil.example/{own}", "http://127.0.0.1:1"):
        assert answer(server, home, Origin=origin) == 403, origin
    where = urlsplit(server.address)
    before = list(server.folder.rglob("*"))
    assert answer(server, "/photographs?name=a&batch=b&count=1", method="PUT") == 403
    assert list(server.folder.rglob("*")) == before
    with socket.socket() as elsewhere:  # another address of this machine: nobody listens there
        elsewhere.settimeout(5)
        assert elsewhere.connect_ex(("127.0.0.2", where.port or 0)) != 0


def test_files_outside_of_the_folder_are_out_of_reach(server: Server) -> None:
    token, secret = urlsplit(server.address).query, server.folder.parent / "secret.h5"
    secret.write_text("secret")
    (server.folder / "link.h5").symlink_to(secret)
    (server.folder / "inside.txt").write_text("inside")
    assert answer(server, f"/files?path=inside.txt&{token}") == 200
    outside = (
        "../secret.h5",
        str(secret),
        "link.h5",
        "/etc/passwd",
        "..%2Fsecret.h5",
        "a/../../secret.h5",
    )
    for path in outside:
        assert answer(server, f"/files?path={path}&{token}") == 403, path
    assert answer(server, f"/photographs?image=..%2Fsecret.h5&{token}") == 404
    assert answer(server, f"/..%2F..%2Fetc%2Fpasswd?{token}") == 404


def test_nothing_is_asked_of_another_machine(small: Window) -> None:
    """What our own policy for the page would keep it from asking is an error in the browser's log."""
    small.find_corners()
    small.tab("Print a board")
    small.until(lambda: small.find_all(".board-picture[src^=data]"))
    asked = set(small.browser.execute_script("return performance.getEntriesByType('resource').map((one) => one.name)"))
    assert {urlsplit(url).scheme for url in asked} <= {"http", "data", "blob"}
    assert {urlsplit(url).hostname for url in asked if urlsplit(url).scheme == "http"} == {"127.0.0.1"}
    assert not [entry for entry in small.browser.get_log("browser") if entry["level"] == "SEVERE"]


# --- when things go wrong ---------------------------------------------------------------------------------------------


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
    table = {row[1]: row for row in window.rows("images")}
    assert table["notes.txt"][2] == table["empty.png"][2] == "unreadable"
    assert "empty" in table["empty.png"][-1]
    assert table["grey.png"][2] == "no board"
    assert table["grey.png"][-1]
    assert table["small.png"][2] in ("wrong size", "no board")
    assert table["01.png"][2:4] == ["used", "54"]
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
    window.drop([tmp_path], ".step .drop")
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
    small.click("find-corners")
    small.click("cancel")
    small.until(lambda: "stopped" in small.status or small.status.startswith("The board is found"))
    small.until(lambda: small.enabled("find-corners"))
    small.find_corners()
    assert small.status == "The board is found in 12 of 12 photographs."


def test_reload_in_the_middle_and_a_second_tab_lose_nothing(small: Window) -> None:
    browser = small.browser
    small.click("find-corners")
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
    browser.close()
    browser.switch_to.window(first)
    small.until(lambda: small.rms == f"{rms:.4f} px")
    small.until(lambda: small.element("camera-name").get_attribute("value") == "renamed")


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
        assert len(window.rows("images")) == 12
        window.tab("Capture")  # here without Basler's SDK
        window.until(lambda: "pip install 'opencsp-calib[basler]'" in window.element("capture-lacking").text)
        assert not window.enabled("capture-start")
        window.leave()


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


# --- beside calibrating -----------------------------------------------------------------------------------------------


def test_put_back_is_as_before(calibrated: Window) -> None:
    rms = calibrated.rms
    calibrated.row("worst-images", 1).find_element("css selector", ".q-checkbox").click()
    calibrated.press("Remove and recalibrate")
    calibrated.until(lambda: "from 11 views" in calibrated.status)
    calibrated.until(lambda: calibrated.text_is_there("moved by"))
    calibrated.tab("Photographs")
    calibrated.until(lambda: [row for row in calibrated.rows("images") if row[2] == "left out"])
    out = next(index for index, row in enumerate(calibrated.rows("images")) if row[2] == "left out")
    calibrated.row("images", out).find_element("css selector", ".q-checkbox").click()
    calibrated.press("Put back")
    calibrated.until(lambda: "from 12 views" in calibrated.status)
    assert calibrated.rms == rms


def test_an_existing_camera(small: Window, small_world: SmallWorld, tmp_path: Path) -> None:
    small_world.camera.save(small.server.folder / "truth.h5")
    small.tab("Existing camera")
    small.type("camera-file", "../truth.h5")
    small.click("open-camera")
    small.until(lambda: "outside of" in small.status)
    small.type("camera-file", "truth.h5")
    small.click("open-camera")
    small.until(lambda: small.text_is_there("800.000 px"))
    write_camera_file(small_world.camera, tmp_path / "from-elsewhere.yaml", "opencv")
    small.drop([tmp_path / "from-elsewhere.yaml"], ".narrow .drop")
    small.until(lambda: small.status == "opencsp-calib-session/cameras/from-elsewhere.yaml is open.")
    small.type("compare-with", "truth.h5")
    small.click("compare-cameras")
    small.until(lambda: small.text_is_there("at infinity: rms "))
    compared = small.browser.find_element("tag name", "body").text.split("at infinity: rms ")[1]
    assert float(compared.split()[0]) < 1e-6
    small.click("check-camera")
    small.until(lambda: small.status == "Checked: small: ok")
    small.picture("existing-camera")
    small.type("convert-to", "camera.json")
    small.click("convert-camera")
    small.until(lambda: "--to" in small.status or "saved" in small.status)
    small.type("convert-to", "again.h5")
    small.click("convert-camera")
    small.until(lambda: small.status == "Camera saved: again.h5")
    assert Camera.load(small.server.folder / "again.h5") == small_world.camera
    small.click("undistort")
    small.until(lambda: "12 images saved in undistorted" in small.status)
    assert len(list((small.server.folder / "undistorted").glob("*.png"))) == 12


def test_cross_validation_and_the_report(calibrated: Window) -> None:
    calibrated.tab("Cross-validation")
    calibrated.press("Cross-validate")
    calibrated.until(lambda: calibrated.status.startswith("The solvers"))
    calibrated.until(lambda: calibrated.text_is_there("Solver against solver"))
    calibrated.picture("cross-validation")
    calibrated.choose("What", "Report (HTML)")
    calibrated.type("save-as", "report")
    calibrated.click("save-camera")
    calibrated.until(lambda: calibrated.status == "Report saved: report.html")
    assert "Provenance" in (calibrated.server.folder / "report.html").read_text(encoding="utf-8")


def test_a_camera_file_is_solved_again_and_views_are_left_out(calibrated: Window) -> None:
    rms, folder = calibrated.rms, calibrated.server.folder
    calibrated.type("save-as", "to-solve-again.h5")
    calibrated.click("save-camera")
    calibrated.until(lambda: calibrated.status == "Camera saved: to-solve-again.h5")
    calibrated.tab("Existing camera")
    calibrated.type("camera-file", "to-solve-again.h5")
    calibrated.click("open-camera")
    calibrated.until(lambda: calibrated.enabled("solve-again"))
    calibrated.click("solve-again")
    calibrated.until(lambda: calibrated.status.startswith("Corners of 12 views"))
    assert not calibrated.enabled("find-corners")
    calibrated.calibrate()
    assert calibrated.rms == rms
    calibrated.browser.find_element("css selector", ".more .q-item").click()
    calibrated.until(lambda: calibrated.element("drop-worst").is_displayed())
    calibrated.type("drop-worst", "2")
    calibrated.click("calibrate")
    calibrated.until(lambda: "from 10 views" in calibrated.status)
    calibrated.type("drop-worst", "")
    calibrated.click("save-camera")
    calibrated.press("Overwrite")
    calibrated.until(lambda: calibrated.status == "Camera saved: to-solve-again.h5")
    run_cli("solve", folder / "to-solve-again.h5", "-o", folder / "by-cli.h5")
    assert Camera.load(folder / "by-cli.h5") == Camera.load(folder / "to-solve-again.h5")


def test_many_cameras(window: Window, photographs: Path) -> None:
    fleet = window.server.folder / "fleet"
    for name in ("north", "south"):
        (fleet / name).mkdir(parents=True)
    for photograph in sorted(photographs.glob("*.png"))[:5]:
        (fleet / "north" / photograph.name).write_bytes(photograph.read_bytes())
    write_image(np.full((240, 320), 60, np.uint8), fleet / "south" / "grey.png")
    window.describe("small", 9, 6, 30)
    window.tab("Many cameras")
    window.type("fleet-folder", "fleet")
    window.click("calibrate-fleet")
    window.until(lambda: window.status.startswith("2 cameras done, "))
    told = window.element("fleet-results").text
    assert "south: no board" in told
    assert (fleet / "north" / "camera.h5").is_file()
    assert not (fleet / "south" / "camera.h5").exists()
    assert (fleet / "fleet.html").is_file()
    window.picture("many-cameras")
    window.tab("About")
    window.until(lambda: window.text_is_there("Agisoft Metashape"))
    window.picture("about")


def test_the_keyboard_alone_will_do(calibrated: Window) -> None:
    """Tab comes to every field and button in the order of use; what has the keyboard is seen; space presses."""
    from selenium.webdriver import ActionChains, Keys

    calibrated.open()  # with nothing clicked on yet
    order = []
    while order[-1:] != ["save-camera"] and len(order) < 60:
        ActionChains(calibrated.browser).send_keys(Keys.TAB).perform()
        order.append(calibrated.focused())
    wanted = "camera-name grid-x grid-y square-size select-images find-corners view-corners calibrate"
    wanted += " reprojection-error visualize-distortion save-camera"
    assert [name for name in order if name in wanted.split()] == wanted.split()
    around = "return getComputedStyle(document.activeElement).boxShadow"
    assert calibrated.browser.execute_script(around) != "none"
    calibrated.browser.execute_script("document.querySelector('[data-testid=visualize-distortion]').focus()")
    ActionChains(calibrated.browser).send_keys(" ").perform()
    calibrated.until(lambda: calibrated.find_all("img[alt='size of the distortion']"))


def test_print_a_board(window: Window, tmp_path: Path) -> None:
    window.tab("Print a board")
    window.type("board-spec", "checkerboard:5x4:30mm")
    window.click("save-board")
    window.until(lambda: window.status.startswith("Board saved: board.pdf"))
    run_cli("board", "checkerboard:5x4:30mm", "-o", tmp_path / "cli.pdf")
    assert (window.server.folder / "board.pdf").read_bytes() == (tmp_path / "cli.pdf").read_bytes()


def test_a_camera_is_no_file_name(window: Window, photographs: Path) -> None:
    """A name with a path in it stays within the folder; photographs in the folder need no upload."""
    folder = window.server.folder
    around = set(folder.parent.iterdir())
    (folder / "set").mkdir()
    for photograph in sorted(photographs.glob("*.png"))[:5]:
        (folder / "set" / photograph.name).write_bytes(photograph.read_bytes())
    window.describe("../evil", 9, 6, 30)
    window.type("photograph-folder", "set")
    window.press("Use")
    window.until(lambda: window.status == "5 photographs in set.")
    window.find_corners()
    window.calibrate()
    window.click("save-camera")
    window.until(lambda: window.status == "Camera saved: evil.h5")
    assert set(folder.parent.iterdir()) == around
