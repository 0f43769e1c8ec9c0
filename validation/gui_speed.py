"""How long the window takes against the command line, how soon it answers, and how much memory its server needs.

Claim
    50 photographs of 1626 x 1236: from Select to saved in at most 1.3 times the command line's time plus 2 s; the page
    answers within 0.2 s meanwhile; the server stays under 1 GB with 500 photographs; the first page is there in under
    2 s after the start.

Way
    Photographs of the demo, and for 500 ten of each, told apart by bytes after their end. Headless Chromium driven as
    in the tests, so that uploads, pictures in the page and the download are in the time; the same files and options by
    the command line in the same run. Answers are those to clicks on tabs and on the button for the page's colours, from
    the click to the frame that shows what the page answers, 0.2 s after each other while corners are looked for; of
    three searches, since one of 50 photographs is over after a few clicks. How much of it is the server's is
    measured in three more runs, in which nobody clicks: another page, of no browser, sends a click on a tab every
    0.05 s and asks for a file, from before the upload until all is saved.
    Memory is the most that the server's process ever held (VmHWM), Linux only; that of its worker stands beside it.

Run ``python validation/bench.py gui_speed``: about ten minutes on two idle cores.
"""

import http.client
import os
import shutil
import sys
import tempfile
import time
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))

from _server_answers import ServerAnswers
from gui_window import Server, Window, run_cli

from opencsp_calib.demo import make_demo
from opencsp_calib.detecting import usable_cores

BOARD = "checkerboard:21x18:50mm"


def browser(folder: Path) -> Any:
    """Headless Chromium, with downloads going to the folder."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium") or ""
    flags = "--headless=new --no-sandbox --disable-gpu --disable-background-networking --disable-dev-shm-usage"
    for flag in (*flags.split(), "--window-size=1280,860", f"--user-data-dir={folder / 'profile'}"):
        options.add_argument(flag)
    options.add_experimental_option("prefs", {"download.default_directory": str(folder)})
    return webdriver.Chrome(options=options, service=webdriver.ChromeService(shutil.which("chromedriver")))


def first_page(folder: Path) -> float:
    """Seconds from starting the program to its first page."""
    begin = time.perf_counter()
    with Server(folder) as server:
        ask(server)
        return time.perf_counter() - begin


def ask(server: Server) -> float:
    """Seconds that a whole page takes."""
    begin, where = time.perf_counter(), urlsplit(server.address)
    connection = http.client.HTTPConnection(where.hostname or "", where.port or 0, timeout=60)
    connection.request("GET", f"/?{where.query}")
    connection.getresponse().read()
    connection.close()
    return time.perf_counter() - begin


CLICK = """
    const [button, answer, done] = arguments, begun = performance.now();
    const first = (path) => document.evaluate(path, document, null, 9 /* the first */).singleNodeValue;
    const answered = () => first(answer)?.checkVisibility({ visibilityProperty: true });
    const drawn = () => done((performance.now() - begun) / 1000);
    const look = () => requestAnimationFrame(answered() ? drawn : look);
    first(button).click();
    look();
"""
"""Seconds until the page has drawn what the server answers, looked at before each frame."""

TAB = "//*[@role='tab' and normalize-space()='{}']"
CLICKS = (
    (TAB.format("Found corners"), "//*[@data-testid='viewed']"),
    (TAB.format("Photographs"), "//*[@data-testid='images']"),
    ("//button[starts-with(@aria-label, 'Colours')]", "//button[@aria-label='Colours: dark']"),
    (TAB.format("Print a board"), "//img[contains(@class, 'board-picture')]"),
    (TAB.format("Calibrate"), "//*[@data-testid='images']"),
    ("//button[starts-with(@aria-label, 'Colours')]", "//button[@aria-label='Colours: light']"),
    (TAB.format("About"), "//*[contains(@class, 'about')]"),
    (TAB.format("Calibrate"), "//*[@data-testid='images']"),
    ("//button[starts-with(@aria-label, 'Colours')]", "//button[@aria-label='Colours: as the system']"),
)
"""What is clicked in turn, and what is there once it is answered: the server decides all but the colours."""


def by_window(window: Window, images: list[Path], *, asking: bool) -> tuple[float, list[float]]:
    """Seconds from selecting to saved, and those that answers to a click took meanwhile."""
    window.open()
    window.describe("demo", 21, 18, 50)
    answers = []
    begin = time.perf_counter()
    window.select(images)
    window.until(lambda: window.enabled("find-corners"), 600)
    window.click("find-corners")
    while asking and not window.status.startswith("The board is found"):
        answers.append(window.browser.execute_async_script(CLICK, *CLICKS[len(answers) % len(CLICKS)]))
        time.sleep(0.2)
    if asking:
        window.browser.execute_async_script(CLICK, *CLICKS[-2])  # back to where the search was begun
    window.until(lambda: window.status.startswith("The board is found"), 1200)
    window.calibrate()
    window.click("save-camera")
    window.until(lambda: window.status.startswith("Camera saved"))
    seconds = time.perf_counter() - begin
    window.leave()
    return seconds, answers


def most_memory(process: int) -> tuple[float, float]:
    """GB that the process, and its largest child, ever held."""

    def held(number: int) -> float:
        lines = Path(f"/proc/{number}/status").read_text(encoding="ascii").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) / 1e6

    children = Path(f"/proc/{process}/task/{process}/children").read_text(encoding="ascii").split()
    return held(process), max((held(int(child)) for child in children), default=0.0)


def main() -> None:
    """Print the figures."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        images = list(make_demo(folder / "demo", 50, jobs=usable_cores()).images)
        starts = sorted(first_page(_new(folder, f"start{n}")) for n in range(3))
        begin = time.perf_counter()
        run_cli("calibrate", *images, "--board", BOARD, "--name", "demo", "-o", folder / "cli.h5")
        cli = time.perf_counter() - begin
        chromium = browser(folder)
        with Server(_new(folder, "fifty")) as server:
            alone, _ = by_window(Window(chromium, server), images, asking=False)
        answers, events, requests = [], [], []
        for n in range(3):
            with Server(_new(folder, f"asked{n}")) as server:
                answers += by_window(Window(chromium, server), images, asking=True)[1]
            with Server(_new(folder, f"beside{n}")) as server, ServerAnswers(server) as asked:
                by_window(Window(chromium, server), images, asking=False)
            events += asked.events
            requests += asked.requests
        with Server(_new(folder, "many")) as server:
            many, _ = by_window(Window(chromium, server), _many(images, _new(folder, "copies")), asking=False)
            own, worker = most_memory(server.process.pid)
        chromium.quit()
    print("\n| what | measured | wanted |\n|---|---|---|")
    print(f"| first page after start, median of 3 | {starts[1]:.2f} s | under 2 s |")
    print(f"| 50 photographs, command line | {cli:.1f} s | |")
    print(f"| 50 photographs, window | {alone:.1f} s | at most {1.3 * cli + 2:.1f} s |")
    print(f"| {len(answers)} clicks, to the frame drawn: median / 95 % / slowest | {_spread(answers)} s | 0.2 s |")
    print(f"| of it the server: {len(events)} clicks' messages to its answers | {_spread(events)} s | |")
    print(f"| {len(requests)} requests to its answers | {_spread(requests)} s | |")
    print(f"| 500 photographs, window | {many:.0f} s | |")
    print(f"| memory of the server with 500 / of its worker | {own:.2f} / {worker:.2f} GB | under 1 GB |")


def _new(folder: Path, name: str) -> Path:
    (folder / name).mkdir()
    return folder / name


def _spread(seconds: list[float]) -> str:
    """Their median, that which 95 % do not exceed, and the largest."""
    return " / ".join(f"{sorted(seconds)[int(part * (len(seconds) - 1))]:.3f}" for part in (0.5, 0.95, 1.0))


def _many(images: list[Path], folder: Path) -> list[Path]:
    copies = []
    for image in images:
        for number in range(10):
            copy = folder / f"{image.stem}-{number}.png"
            copy.write_bytes(image.read_bytes() + os.urandom(8))
            copies.append(copy)
    return copies


if __name__ == "__main__":
    main()
