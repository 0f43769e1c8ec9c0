"""What the window can do beside calibrating: old cameras, many cameras, boards, reports; and by the keyboard alone."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from camera_files import assert_same_files
from gui_window import Window, run_cli
from worlds import SmallWorld

from opencsp_calib import Camera, Checkerboard
from opencsp_calib.board_file import write_board_file
from opencsp_calib.images import write_image
from opencsp_calib.registry import installed

pytestmark = pytest.mark.timeout(1200)


def line_in_the_chart(window: Window) -> float:
    """The rms at which the line across the bars is drawn, by where its label stands; 0 before it is there."""
    script = """
        const bars = document.querySelector(".bars"), box = (element) => element.getBoundingClientRect();
        const texts = [...(bars?.querySelectorAll("text") ?? [])];
        const label = texts.find((text) => `${text.textContent} px` === arguments[0]);
        const middle = label && box(label).y + box(label).height / 2 - box(bars).y;
        return label ? getElement(Number(bars.id.slice(1))).chart.convertFromPixel({ yAxisIndex: 0 }, middle) : 0;
    """
    return float(window.browser.execute_script(script, window.rms))


def test_put_back_is_as_before(calibrated: Window) -> None:
    rms = calibrated.rms
    calibrated.click("reprojection-error")
    drawn = calibrated.until(lambda: line_in_the_chart(calibrated))
    assert drawn == pytest.approx(float(rms.split()[0]), rel=0.05)
    calibrated.tick("worst-images", 1)
    calibrated.press("Remove and recalibrate")
    calibrated.until(lambda: "from 11 views" in calibrated.status)
    calibrated.until(lambda: calibrated.text_is_there("moved by"))
    calibrated.tab("Photographs")
    calibrated.until(lambda: [row for row in calibrated.rows("images") if row[2] == "left out"])
    out = next(index for index, row in enumerate(calibrated.rows("images")) if row[2] == "left out")
    calibrated.tick("images", out)
    calibrated.press("Put back")
    calibrated.until(lambda: "from 12 views" in calibrated.status)
    assert calibrated.rms == rms


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


def test_the_keyboard_does_not_go_behind_what_is_seen(window: Window) -> None:
    """Not even to a tab that would scroll, if it were in front."""
    from selenium.webdriver import ActionChains, Keys

    size = window.browser.get_window_size()
    window.browser.set_window_size(1000, 500)
    window.tab("Capture")
    behind = "return document.activeElement.closest('.behind, [aria-hidden=true]')?.ariaLabel"
    for _ in range(20):
        ActionChains(window.browser).send_keys(Keys.TAB).perform()
        assert not window.browser.execute_script(behind)
    window.browser.set_window_size(size["width"], size["height"])


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
    calibrated.press("Keep it")
    assert calibrated.element("rms").get_attribute("textContent") == rms
    calibrated.until(lambda: not calibrated.find_all(".q-dialog"))
    calibrated.click("solve-again")
    calibrated.press("Forget it")
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
    calibrated.until(lambda: calibrated.text_is_there("Something above was changed since: calibrate again."))
    calibrated.click("save-camera")
    calibrated.press("Overwrite")
    calibrated.until(lambda: calibrated.status == "Camera saved: to-solve-again.h5")
    run_cli("solve", folder / "to-solve-again.h5", "-o", folder / "by-cli.h5")
    assert Camera.load(folder / "by-cli.h5") == Camera.load(folder / "to-solve-again.h5")


def test_an_existing_camera(small: Window, small_world: SmallWorld, tmp_path: Path) -> None:
    small_world.camera.save(small.server.folder / "truth.h5")
    small.tab("Existing camera")
    small.type("camera-file", "../truth.h5")
    small.click("open-camera")
    small.until(lambda: "outside of" in small.status)
    small.type("camera-file", "truth.h5")
    small.click("open-camera")
    small.until(lambda: small.text_is_there("800.000 px"))
    other = replace(small_world.camera, params=0.9 * small_world.camera.params)
    two = {"1": other, "2": small_world.camera}
    installed().camera_formats["colmap"].write(two, tmp_path / "cameras.txt")
    small.drop([tmp_path / "cameras.txt"], ".narrow .drop")
    small.until(lambda: small.status.endswith('choose one with "Which of several cameras": 1, 2'))
    small.type("which-camera", "2")
    small.click("open-camera")
    small.until(lambda: small.status == "opencsp-calib-session/cameras/cameras.txt is open.")
    small.type("compare-with", "truth.h5")
    small.click("compare-cameras")
    small.until(lambda: small.text_is_there("at infinity: rms "))
    compared = small.browser.find_element("tag name", "body").text.split("at infinity: rms ")[1]
    assert float(compared.split()[0]) < 1e-6
    small.click("check-camera")
    small.until(lambda: small.status == "Checked: cameras 2: ok")
    small.picture("existing-camera")
    small.type("convert-to", "camera.json")
    small.click("convert-camera")
    small.until(lambda: 'add "Format" under Convert' in small.status)
    small.type("convert-to", "again.h5")
    small.click("convert-camera")
    small.until(lambda: small.status == "Camera saved: again.h5")
    again = Camera.load(small.server.folder / "again.h5")
    np.testing.assert_allclose(again.params, small_world.camera.params, rtol=1e-12)
    undistorted = small.server.folder / "undistorted"
    undistorted.mkdir()
    (undistorted / "01.png").write_bytes(b"mine")
    small.click("undistort")
    small.press("Keep it")
    small.until(lambda: not small.find_all(".q-dialog"))
    assert (undistorted / "01.png").read_bytes() == b"mine"
    small.click("undistort")
    small.press("Overwrite")
    small.until(lambda: "12 images saved in undistorted" in small.status)
    assert len(list(undistorted.glob("*.png"))) == 12


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


def test_print_a_board(window: Window, tmp_path: Path) -> None:
    window.tab("Print a board")
    window.type("board-spec", "checkerboard:5x4:30mm")
    window.click("save-board")
    window.until(lambda: window.status.startswith("Board saved: board.pdf"))
    run_cli("board", "checkerboard:5x4:30mm", "-o", tmp_path / "cli.pdf")
    assert (window.server.folder / "board.pdf").read_bytes() == (tmp_path / "cli.pdf").read_bytes()


def test_a_measured_board_and_a_camera_that_is_no_file_name(window: Window, photographs: Path, tmp_path: Path) -> None:
    """A name with a path in it stays within the folder; photographs and the board in the folder need no upload."""
    folder, board = window.server.folder, Checkerboard(9, 6, 0.03)
    measured = board.points + np.random.default_rng(1).normal(0, 1e-4, board.points.shape)
    write_board_file(board.with_points(measured), folder / "board.json")
    around = set(folder.parent.iterdir())
    (folder / "set").mkdir()
    for photograph in sorted(photographs.glob("*.png"))[:5]:
        (folder / "set" / photograph.name).write_bytes(photograph.read_bytes())
    window.describe("../evil v1.2", 9, 6, 30)
    window.type("photograph-folder", "set")
    window.press("Use")
    window.until(lambda: window.status == "5 photographs in set.")
    window.choose("Board", "in a file")
    window.type("board-described", "board.json")
    window.until(lambda: window.enabled("find-corners"))
    (folder / "set" / "05.png").unlink()
    window.click("find-corners")
    window.until(lambda: window.status.startswith("No longer there: 05.png."))
    window.find_corners()
    assert window.status == "The board is found in 4 of 4 photographs."
    window.calibrate()
    window.click("save-camera")
    window.until(lambda: window.status == "Camera saved: evil v1.2.h5")
    assert set(folder.parent.iterdir()) == around
    by_cli = tmp_path / "cli.h5"
    run_cli("calibrate", folder / "set", "--board", folder / "board.json", "--name", "../evil v1.2", "-o", by_cli)
    assert_same_files(folder / "evil v1.2.h5", by_cli)
    window.choose("Board", "checkerboard")
