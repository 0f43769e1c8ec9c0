"""Starting the window: a socket on this machine, a token, one address."""

import logging
import secrets
import socket
import sys
import threading
import webbrowser
from collections.abc import Callable
from pathlib import Path

import nicegui
import uvicorn
from fastapi import FastAPI
from nicegui import ui

from opencsp_calib.errors import InputError
from opencsp_calib.gui.guard import LOCAL, Guard
from opencsp_calib.gui.page import show
from opencsp_calib.gui.routes import routes
from opencsp_calib.gui.session import Session
from opencsp_calib.stopping import stop_when_told

__all__ = ["serve"]


def serve(folder: Path, host: str, port: int, *, open_browser: bool) -> None:
    """Serve the window until it is stopped (Ctrl-C); prints its address, on a line of its own.

    Parameters
    ----------
    folder : Path
        Below which all files are.
    host : str
        The address to listen on.
    port : int
        0 takes a free one.
    open_browser : bool

    Raises
    ------
    InputError
        If the folder is none, or the address cannot be listened on.
    """
    listening = _listening(host, port)
    token = secrets.token_urlsafe(24)
    session = Session(folder)
    address = f"http://{_name(host)}:{listening.getsockname()[1]}/?token={token}"

    def opened() -> None:
        if open_browser:
            threading.Thread(target=webbrowser.open, args=(address,), daemon=True).start()

    open_to_all = host not in LOCAL
    names = (host, socket.gethostname(), socket.getfqdn()) if open_to_all else ()
    guarded = Guard(_application(session, opened), token, names, any_address=open_to_all)
    server = uvicorn.Server(uvicorn.Config(guarded, log_level="error", access_log=False, ws_max_size=2**24))
    logging.getLogger("nicegui").setLevel(logging.ERROR)  # else each address that is not there is told, with the token
    stop_when_told(server.handle_exit)  # the usual end, from the address on
    sys.stdout.write(address + "\n")
    sys.stdout.flush()
    server.run(sockets=[listening])


def _application(session: Session, started: Callable[[], None]) -> FastAPI:
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None)
    app.include_router(routes(session))
    nicegui.app.on_startup(session.worker.start)
    nicegui.app.on_startup(started)
    nicegui.app.on_shutdown(session.close)
    ui.page("/", title=f"Camera calibration: {session.folder.name}")(lambda: show(session))
    ui.run_with(app, dark=None, tailwind=False, reconnect_timeout=10.0, show_welcome_message=False)
    return app


def _listening(host: str, port: int) -> socket.socket:
    try:
        family, kind, protocol, _, where = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
        listening = socket.socket(family, kind, protocol)
        if sys.platform != "win32":  # there it would let another program listen too
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(where)
    except (OSError, OverflowError) as error:
        raise InputError(f"cannot listen on {host}, port {port}: {error}; take another --port") from None
    listening.listen(128)
    return listening


def _name(host: str) -> str:
    """What to call this machine in the address."""
    if host in ("0.0.0.0", "::"):  # noqa: S104  # asked for by --host
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host
