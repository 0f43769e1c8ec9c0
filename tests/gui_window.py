"""Driving the calibration window as a person does: by the words on it, and by its test ids."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

PATIENCE_S = 300  # of a machine that is slow, or busy with other things
SCREENSHOTS = os.environ.get("OPENCSP_CALIB_SCREENSHOTS")
"""A folder to put a picture of every step into."""


def run_cli(*arguments: object) -> None:
    """The command line, which must succeed."""
    subprocess.run([sys.executable, "-m", "opencsp_calib", *map(str, arguments)], check=True, capture_output=True)


class Server:
    """``opencsp-calib gui`` in a process of its own."""

    def __init__(self, folder: Path, *options: str, **environment: str) -> None:
        self.folder, self._options = folder, options
        self._environment = os.environ | {"PYLON_CAMEMU": "1"} | environment  # with Basler's emulated cameras

    def __enter__(self) -> "Server":
        command = [sys.executable, "-m", "opencsp_calib", "gui", str(self.folder), "--no-browser", *self._options]
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
        if os.name == "posix":
            pipes["preexec_fn"] = _heard
        self.process = subprocess.Popen(command, **pipes, text=True, env=self._environment, start_new_session=True)
        self.address = self.process.stdout.readline().strip()
        match = re.fullmatch(r"(http://[\w.-]+:[0-9]+/)\?token=([\w-]{20,})", self.address)
        assert match, self.process.communicate()
        self.root = match[1]
        return self

    def __exit__(self, *_: object) -> None:
        if self.process.returncode is not None:
            pass  # the test has ended it
        elif os.name == "posix":  # as Ctrl-C in a terminal, which its own processes get too
            os.killpg(self.process.pid, signal.SIGINT)
        else:
            self.process.terminate()
        self.more_output, self.errors = self.process.communicate(timeout=120)

    def hold_worker(self) -> None:
        """Have the process for long work stand still: what it is asked to do is not over before it is looked at."""
        import psutil

        workers = [child for child in psutil.Process(self.process.pid).children() if "gui.jobs" in child.cmdline()[-1]]
        assert len(workers) == 1
        workers[0].suspend()


def _heard() -> None:
    """Have signals heard that a shell, or nohup, which started the tests aside has them ignore."""
    for ignored in (signal.SIGINT, signal.SIGHUP):
        signal.signal(ignored, signal.SIG_DFL)


class Window:
    """The page in a browser."""

    def __init__(self, browser: Any, server: Server) -> None:
        self.browser, self.server = browser, server

    def open(self) -> None:
        self.browser.get(self.server.address)
        # what is typed before the page has its connection comes late, and out of order
        self.until(lambda: self.status and self.browser.execute_script("return window.did_handshake"))

    def leave(self) -> None:
        """Close the page: an open one would go on looking for its server, at the cost of what follows."""
        self.browser.get("about:blank")

    def clear(self) -> None:
        """Begin again, without photographs and results."""
        clear = "//button[normalize-space()='Clear']"
        self.until(lambda: not self.element("cancel").is_displayed())
        if self.browser.find_element("xpath", clear).is_enabled():
            self.press("Clear")
            if any(map(str.isdigit, self.rms)):
                self.press("Forget it")
        self.until(lambda: self.text_is_there("0 photographs"))

    def has_result(self, views: int) -> bool:
        """Whether a camera is calibrated from that many photographs, with none left out."""
        complete = self.text_is_there(f"\n{views} photographs") and not self.text_is_there("Left out:")
        return complete and any(map(str.isdigit, self.rms))

    def element(self, testid: str) -> Any:
        return self.browser.find_element("css selector", f"[data-testid={testid}]")

    def until(self, true: Callable[[], Any], patience_s: float = PATIENCE_S) -> Any:
        """Wait until it is true; elements that are made anew, just going, or on the move, do not matter."""
        from selenium.common import exceptions

        passing = (
            exceptions.NoSuchElementException,
            exceptions.StaleElementReferenceException,
            exceptions.ElementNotInteractableException,
            exceptions.ElementClickInterceptedException,
        )
        end = time.monotonic() + patience_s
        while True:
            try:
                if found := true():
                    return found
            except passing:
                found = None
            if time.monotonic() > end:
                self.picture("gave-up")
                raise AssertionError(f"not within {patience_s} s; status: {self.status}")
            time.sleep(0.1)

    def type(self, testid: str, text: str) -> None:
        field = self.until(lambda: self.element(testid))
        field.clear()
        field.send_keys(text)

    def click(self, testid: str) -> None:
        self.until(lambda: self._pressed(self.element(testid)))

    def press(self, words: str) -> None:
        """Click the button with these words on it."""
        button = f"//button[normalize-space()='{words}']"
        self.until(lambda: self._pressed(self.browser.find_element("xpath", button)))

    def _pressed(self, button: Any) -> bool:
        """Press it, if it can be pressed."""
        if not button.is_enabled():
            return False
        button.click()
        return True

    def find_all(self, selector: str) -> list[Any]:
        """Those that are not behind another tab."""
        script = (
            "return [...document.querySelectorAll(arguments[0])]"
            ".filter(element => element.checkVisibility({visibilityProperty: true}))"
        )
        return list(self.browser.execute_script(script, selector))

    def text_is_there(self, text: str) -> bool:
        return text in str(self.browser.execute_script("return document.body.innerText"))  # quicker than the driver's

    def tick(self, testid: str, index: int) -> None:
        """Press the checkbox of a row."""
        boxes = f"[data-testid={testid}] tbody input[type=checkbox]"
        self.until(lambda: self._pressed(self.find_all(boxes)[index]))

    def rows(self, testid: str) -> list[list[str]]:
        """The words in a table, but for the cells of its checkboxes."""
        # read in one go: the table may be made anew between two questions
        script = (
            "return [...document.querySelectorAll(arguments[0])].map("
            "row => [...row.querySelectorAll('td')].slice(1).map(cell => cell.innerText.trim()))"
        )
        rows = f"[data-testid={testid}] tbody tr"
        return [list(map(str, row)) for row in self.browser.execute_script(script, rows)]

    def tab(self, name: str) -> None:
        """Bring a tab to the front."""
        tab = f"//*[@role='tab' and normalize-space()='{name}']"
        self.until(lambda: self._pressed(self.browser.find_element("xpath", tab)))
        self.until(lambda: self.find_all(f"[role=tabpanel][aria-label='{name}']:not(.behind)"))

    def choose(self, label: str, words: str) -> None:
        """Take one of the choices of a field."""
        self.browser.find_element("css selector", f".q-select input[aria-label='{label}']").click()
        option = f"//*[@role='option' and normalize-space()='{words}']"
        self.until(lambda: self.browser.find_element("xpath", option).is_displayed())
        self.browser.find_element("xpath", option).click()

    def enabled(self, testid: str) -> bool:
        return bool(self.element(testid).is_enabled())

    @property
    def status(self) -> str:
        return self._words("status")

    @property
    def rms(self) -> str:
        return self._words("rms")

    def _words(self, testid: str) -> str:
        """Those of an element as it is now, asked for in one go."""
        script = "return document.querySelector(`[data-testid=${arguments[0]}]`)?.innerText ?? ''"
        return str(self.browser.execute_script(script, testid))

    def focused(self) -> str:
        """What has the keyboard: its test id, else its words."""
        script = (
            "const e = document.activeElement; return e.dataset.testid || e.innerText || e.getAttribute('aria-label')"
        )
        return str(self.browser.execute_script(script)).strip()

    def select(self, paths: list[Path]) -> None:
        self.browser.find_element("css selector", "input[type=file]").send_keys("\n".join(map(str, paths)))

    def drop(self, paths: list[Path], place: str) -> None:
        """Let files go over an element, as if dragged from the desktop."""
        box = self.browser.find_element("css selector", place).rect
        event = {"x": box["x"] + box["width"] / 2, "y": box["y"] + box["height"] / 2}
        event["data"] = {"items": [], "files": [str(path) for path in paths], "dragOperationsMask": 1}
        for kind in ("dragEnter", "dragOver", "drop"):
            self.browser.execute_cdp_cmd("Input.dispatchDragEvent", {"type": kind, **event})

    def describe(self, name: str, columns: int, rows: int, square_mm: float) -> None:
        for testid, value in (("camera-name", name), ("grid-x", columns), ("grid-y", rows), ("square-size", square_mm)):
            self.type(testid, str(value))

    def find_corners(self) -> None:
        self.click("find-corners")
        self.until(lambda: self.status.startswith("The board is found"))

    def calibrate(self) -> float:
        self.click("calibrate")
        self.until(lambda: self.status.startswith("Calibrated"))
        return float(self.rms.split()[0])

    def picture(self, name: str) -> None:
        if SCREENSHOTS:
            Path(SCREENSHOTS).mkdir(parents=True, exist_ok=True)
            self.browser.save_screenshot(str(Path(SCREENSHOTS) / f"{name}.png"))
