"""The window in a real browser: a server as people start it, and headless Chromium."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from gui_window import PATIENCE_S, Server, Window


@pytest.fixture(scope="session")
def chromium() -> Iterator[Any]:
    """One browser for all tests; what it downloads lies in its `downloads`."""
    pytest.importorskip("nicegui")
    webdriver = pytest.importorskip("selenium.webdriver")
    browser, driver = shutil.which("chromium"), shutil.which("chromedriver")
    if not (browser and driver):
        message = "no Chromium here; sh .ci/system-packages installs it"
        if os.environ.get("OPENCSP_CALIB_REQUIRE_BROWSER") == "1":
            pytest.fail(message)
        pytest.skip(message)
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        for flag in (
            "--headless=new",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--disable-dev-shm-usage",
            "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1",  # as with the network's cable out
            "--window-size=1280,720",
            f"--user-data-dir={profile}",
        ):
            options.add_argument(flag)
        downloads = Path(profile) / "downloads"
        downloads.mkdir()
        options.add_experimental_option("prefs", {"download.default_directory": str(downloads)})
        options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
        started = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
        started.downloads = downloads
        started.set_script_timeout(PATIENCE_S)
        started.set_window_size(1280, 720 + 720 - started.execute_script("return innerHeight"))
        yield started
        started.quit()


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory, emulated_cameras: None) -> Iterator[Server]:
    """One server for all tests that can share it: starting one costs more than most of them."""
    with Server(tmp_path_factory.mktemp("work")) as running:
        yield running
    assert (running.more_output, running.errors) == ("", "")


@pytest.fixture
def page(chromium: Any, server: Server) -> Iterator[Window]:
    """The page of that server, as the test before left it."""
    opened = Window(chromium, server)
    opened.open()
    yield opened
    opened.leave()


@pytest.fixture
def window(page: Window) -> Window:
    """The page with no photographs and no results."""
    page.clear()
    return page


@pytest.fixture
def small(window: Window, photographs: Path) -> Window:
    """With photographs of the small world selected."""
    _select(window, photographs)
    return window


@pytest.fixture
def calibrated(page: Window, photographs: Path) -> Window:
    """With a calibration from them; where the test before left one, with that: tests of it stand together."""
    if not page.has_result(12):
        page.clear()
        _select(page, photographs)
        page.find_corners()
        page.calibrate()
    return page


def _select(window: Window, photographs: Path) -> None:
    window.describe("small", 9, 6, 30)
    window.select(sorted(photographs.glob("*.png")))
    window.until(lambda: window.enabled("find-corners"))
