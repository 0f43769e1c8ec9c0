"""The seed's procedure from the first button to the last, on its own photographs, in a browser."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
from camera_files import assert_same_files
from gui_window import Server, Window, run_cli

pytestmark = pytest.mark.timeout(1200)
STEPS = ("find-corners", "view-corners", "calibrate", "reprojection-error", "visualize-distortion", "save-camera")
BOARD = "checkerboard:18x23:50mm"


@pytest.fixture
def window(chromium: object, tmp_path: Path) -> Iterator[Window]:
    """The page as it is when it is opened for the first time."""
    (tmp_path / "work").mkdir()
    with Server(tmp_path / "work") as server:
        opened = Window(chromium, server)
        opened.open()
        yield opened
        opened.leave()


def test_the_whole_procedure(window: Window, data_dir: Path, tmp_path: Path) -> None:
    photographs = sorted((data_dir / "sandia_checkerboard").glob("*.png"))
    window.picture("1-start")
    assert not any(map(str.isdigit, window.rms))
    for step in STEPS:
        assert not window.enabled(step), step
    window.describe("sandia", 18, 23, 50)
    assert not window.enabled("find-corners")
    window.select(photographs)
    window.until(lambda: window.enabled("find-corners"))
    window.picture("2-selected")
    window.find_corners()
    assert window.status == "The board is found in 10 of 10 photographs."
    window.picture("3-found")
    window.click("view-corners")
    window.until(lambda: window.element("viewed").text == "001.png (1 of 10)")
    window.until(lambda: len(window.find_all("svg image")) == 1)
    window.picture("4-corners")
    before = window.calibrate()
    window.until(lambda: window.find_all(".verdict"))
    window.picture("5-result")
    window.click("reprojection-error")
    window.until(lambda: len(window.find_all(".report img.plot")) == 2)
    window.picture("6-reprojection")
    window.click("visualize-distortion")
    window.until(lambda: window.find_all("img[alt='size of the distortion']"))
    window.picture("7-distortion")
    window.tab("Poses")
    window.until(lambda: len(window.find_all(".space g.board")) == 10 + 1)
    window.picture("8-poses")
    window.tab("Board shape")
    window.until(lambda: window.find_all('img[alt="heights and deviations of the board\'s corners"]'))
    window.picture("8-board-shape")
    window.tab("Uncertainty")
    window.until(lambda: window.find_all("img[alt='influence of each view']"))
    window.picture("8-uncertainty")
    rights = "return [...document.querySelectorAll('main, main *')].map((one) => one.getBoundingClientRect().right)"
    assert max(window.browser.execute_script(rights)) <= window.browser.execute_script("return innerWidth")
    rows = window.rows("worst-images")
    assert len(rows) == 5
    worst = rows[0][0]
    window.tick("worst-images", 0)
    window.press("Remove and recalibrate")
    window.until(lambda: window.status.startswith("Calibrated from 9 views"))
    window.until(lambda: window.text_is_there("1 dropped"))
    window.picture("9-without-the-worst")
    assert float(window.rms.split()[0]) != before
    window.click("save-camera")
    window.until(lambda: window.status == "Camera saved: sandia.h5")
    by_cli = tmp_path / "cli.h5"
    run_cli("calibrate", *photographs, "--board", BOARD, "--name", "sandia", "--exclude", worst, "-o", by_cli)
    assert_same_files(window.server.folder / "sandia.h5", by_cli)
    downloaded = window.browser.downloads / "sandia.h5"
    window.until(downloaded.exists)
    window.until(lambda: downloaded.read_bytes() == (window.server.folder / "sandia.h5").read_bytes())
    shutil.rmtree(window.browser.downloads)
