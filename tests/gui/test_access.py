"""Who is let into the window, and what it asks of others."""

import http.client
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import quote, urlsplit

import pytest
from gui_window import PATIENCE_S, Server, Window

GUI = [sys.executable, "-m", "opencsp_calib", "gui"]

pytestmark = pytest.mark.timeout(1200)


def answer(server: Server, path: str, method: str = "GET", address: str = "127.0.0.1", **headers: str) -> int:
    """The status of a request without the browser's cookie."""
    connection = http.client.HTTPConnection(address, urlsplit(server.address).port or 0, timeout=30)
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
    assert urlsplit(server.address).hostname == "127.0.0.1"
    assert answer(server, home, Origin=f"http://{own}") == 200
    for path in ("/", "/?token=wrong", "/?token=", "/photographs?image=x", "/files?path=x", "/nothing", socket_path):
        assert answer(server, path) == 403, path
    assert answer(server, socket_path, **upgrade) == 403
    for host in ("evil.example", f"evil.example:{urlsplit(own).port}", "127.0.0.1.evil.example", "", "[", "10.0.0.1"):
        assert answer(server, home, Host=host) == 403, host
    for origin in ("http://evil.example", "null", f"https://evil.example/{own}", "http://127.0.0.1:1", "http://["):
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
        quote(str(secret)),
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
    small.browser.get_log("browser")  # gives, and forgets, what the tests before have left in it
    small.open()
    small.find_corners()
    small.tab("Print a board")
    small.until(lambda: small.find_all(".board-picture[src^=data]"))
    asked = set(small.browser.execute_script("return performance.getEntriesByType('resource').map((one) => one.name)"))
    assert {urlsplit(url).scheme for url in asked} <= {"http", "data", "blob"}
    assert {urlsplit(url).hostname for url in asked if urlsplit(url).scheme == "http"} == {"127.0.0.1"}
    assert not [entry for entry in small.browser.get_log("browser") if entry["level"] == "SEVERE"]


@pytest.fixture
def port() -> Iterator[int]:
    """One that nobody else is given as a free one while it is held; who asks for it by its number may listen on it."""
    with socket.socket() as held:
        held.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        held.bind(("127.0.0.1", 0))
        yield held.getsockname()[1]


@pytest.mark.skipif(sys.platform == "win32", reason="a test cannot press Ctrl-C there")
@pytest.mark.parametrize(("told", "delay_s"), [("INT", 0.0), ("INT", 0.02), ("INT", 0.1), ("TERM", 0.0), ("HUP", 0.3)])
def test_it_ends_without_a_word_when_it_is_told(tmp_path: Path, told: str, delay_s: float) -> None:
    """By Ctrl-C, a service manager or a terminal that is closed, from the instant on in which the address is there."""
    with Server(tmp_path) as server:
        time.sleep(delay_s)
        server.process.send_signal(signal.Signals[f"SIG{told}"])
        server.process.wait(60)
    assert (server.process.returncode, server.more_output, server.errors) == (0, "", "")


def test_a_folder_has_one_window_at_a_time(tmp_path: Path) -> None:
    """Two would write the same session file; one that was killed is in nobody's way."""
    with Server(tmp_path) as server:
        second = subprocess.run([*GUI, str(tmp_path / "."), "--no-browser"], capture_output=True, text=True)
        server.process.kill()
        server.process.wait(60)
    assert (second.returncode, second.stdout) == (2, "")
    assert second.stderr.startswith(f"error: {tmp_path} is open in another window already")
    with Server(tmp_path):
        pass


def test_wider_open_it_says_what_that_means(port: int, tmp_path: Path) -> None:
    """Other machines need the token as well, and a page of another name is refused as ever."""
    everywhere = "0.0.0.0"  # noqa: S104
    opened = tmp_path / "opened"  # by what stands in for a browser: the last of --no-browser and --browser counts
    asked = ("--host", everywhere, "--port", str(port), "--browser")
    with Server(tmp_path, *asked, BROWSER=f"sh -c 'echo %s > \"{opened}\"'") as server:
        token = urlsplit(server.address).query
        assert urlsplit(server.address).port == port
        (other := tmp_path / "other").mkdir()
        busy = subprocess.run([*GUI, str(other), "--no-browser", "--port", str(port)], capture_output=True, text=True)
        assert busy.returncode == 2
        assert "take another --port" in busy.stderr
        assert urlsplit(server.address).hostname == socket.gethostname().lower()
        assert answer(server, f"/?{token}", address="127.0.0.2") == 200
        assert answer(server, "/", address="127.0.0.2") == 403
        assert answer(server, f"/?{token}", address="127.0.0.2", Host=f"evil.example:{port}") == 403
        assert answer(server, f"/?{token}", address="127.0.0.2", Origin="http://evil.example") == 403
        end = time.monotonic() + PATIENCE_S  # for the browser, which is of the group that is told to end
        while not (opened.exists() and opened.read_text().strip()) and time.monotonic() < end:
            time.sleep(0.01)
    assert opened.read_text().strip() == server.address
    assert server.more_output == ""
    for words in ("listening on 0.0.0.0", str(tmp_path.resolve()), "nothing on the way is encrypted", "ssh -L"):
        assert words in " ".join(server.errors.split())
