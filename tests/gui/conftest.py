"""The window in a real browser: a server as people start it, and headless Chromium."""

import os
import shutil
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from gui_window import Server, Window


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
            "--window-size=1280,720",
            f"--user-data-dir={profile}",
        ):
            options.add_argument(flag)
        downloads = Path(profile) / "downloads"
        downloads.mkdir()
        options.add_experimental_option("prefs", {"download.default_directory": str(downloads)})
        options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
        started = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
        started.downloads = downloads
        started.set_window_size(1280, 720 + 720 - started.execute_script("return innerHeight"))
        yield started
        started.quit()


@pytest.fixture
def server(tmp_path: Path) -> Iterator[Server]:
    """The window's server, for an empty folder."""
    folder = tmp_path / "work"
    folder.mkdir()
    with Server(folder) as running:
        yield running


@pytest.fixture
def window(chromium: Any, server: Server) -> Window:
    """The page of the server, open."""
    opened = Window(chromium, server)
    opened.open()
    return opened
