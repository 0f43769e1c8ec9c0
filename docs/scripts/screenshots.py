"""Takes docs/images/demo.png (the report) and docs/images/gui_*.png (the window) from a demo, in Chromium.

Run ``python docs/scripts/screenshots.py [VIEWS]``; needs Debian's chromium and chromium-driver.
"""

import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from selenium import webdriver
from selenium.webdriver.support.ui import WebDriverWait

HERE = Path(__file__).resolve().parent
IMAGES = HERE.parent / "images"
FLAGS = ("--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars")
QUIET = ("--disable-background-networking", "--disable-component-update", "--disable-sync")


@contextmanager
def chromium(width: int, height: int) -> Iterator[webdriver.Chrome]:
    """A browser whose page has that size."""
    options = webdriver.ChromeOptions()
    for flag in (*FLAGS, *QUIET):
        options.add_argument(flag)
    browser = webdriver.Chrome(options=options, service=webdriver.ChromeService("/usr/bin/chromedriver"))
    try:
        browser.set_window_size(width, height)
        browser.set_window_size(width, 2 * height - browser.execute_script("return innerHeight"))
        yield browser
    finally:
        browser.quit()


def save(browser: webdriver.Chrome, name: str) -> None:
    """What it shows, once nothing is being drawn any more."""
    WebDriverWait(browser, 120).until(lambda _: "Drawing …" not in browser.page_source)
    time.sleep(1.0)  # what is drawn still fades in
    browser.save_screenshot(str(IMAGES / f"{name}.png"))


def report(demo: Path) -> None:
    """The top of the report."""
    with chromium(1100, 1180) as browser:
        browser.get((demo / "report.html").as_uri())
        save(browser, "demo")


def window(photographs: list[Path], folder: Path) -> None:
    """The window, from the first button to the result; driven as the tests drive it."""
    sys.path.insert(0, str(HERE.parents[1] / "tests"))
    from gui_window import Server, Window

    with Server(folder) as server, chromium(1280, 720) as browser:
        page = Window(browser, server)
        page.open()
        page.describe("demo", 21, 18, 50)
        page.select(photographs)
        page.find_corners()
        save(browser, "gui_found")
        page.calibrate()
        save(browser, "gui_calibrated")


def main() -> None:
    """Make a demo, and take all pictures."""
    views = sys.argv[1] if len(sys.argv) > 1 else "50"
    with tempfile.TemporaryDirectory() as temporary:
        demo, empty = Path(temporary) / "demo", Path(temporary) / "work"
        empty.mkdir()
        subprocess.run([sys.executable, "-m", "opencsp_calib", "demo", demo, "--views", views], check=True)
        report(demo)
        window(sorted(demo.glob("*.png")), empty)


if __name__ == "__main__":
    main()
