"""How soon the server of the window answers by itself, whatever a browser then makes of it."""

import asyncio
import itertools
import re
import threading
import time
from typing import Any
from urllib.parse import urlencode

import aiohttp
import socketio
from gui_window import Server

__all__ = ["ServerAnswers"]

TABS = re.compile(r'"(\d+)":\{"tag":"q-tabs","class":\["result-tabs"\].*?"listener_id":"([^"]+)"')
CLIENT = re.compile(r"'client_id': '([^']+)'")
SHOWN = ("Found corners", "Photographs")
PAUSE_S = 0.05


class ServerAnswers:
    """While it is entered, one more page is open, without a browser; it clicks on tabs and asks for a file.

    Attributes
    ----------
    events : list of float
        Seconds from a click's message on the websocket to the message that answers it.
    requests : list of float
        Seconds that the answer to a request took, that there is no such file.
    """

    def __init__(self, server: Server) -> None:
        self.events: list[float] = []
        self.requests: list[float] = []
        self._server, self._ended = server, threading.Event()
        self._thread = threading.Thread(target=lambda: asyncio.run(self._ask()))

    def __enter__(self) -> "ServerAnswers":
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._ended.set()
        self._thread.join()

    async def _ask(self) -> None:
        async with aiohttp.ClientSession() as web:
            async with web.get(self._server.address) as answer:
                page = await answer.text()
                cookie = {"Cookie": "; ".join(f"{name}={kept.value}" for name, kept in answer.cookies.items())}
            tabs, client = TABS.search(page), CLIENT.search(page)
            if tabs is None or client is None:
                raise ValueError("the page is not written as this study reads it: another version of NiceGUI?")
            socket, answered = socketio.AsyncClient(), asyncio.Event()
            socket.on("update", lambda elements: answered.set() if tabs[1] in elements else None)
            asked = {"client_id": client[1], "next_message_id": 0, "implicit_handshake": "true"}
            asked |= {"document_id": "study", "tab_id": "study"}
            place = {"socketio_path": "/_nicegui_ws/socket.io", "transports": ["websocket"], "headers": cookie}
            await socket.connect(f"{self._server.root}?{urlencode(asked)}", **place)
            event: dict[str, Any] = {"id": int(tabs[1]), "client_id": client[1], "listener_id": tabs[2]}
            for name in itertools.cycle(SHOWN):
                if self._ended.is_set():
                    break
                begin = time.perf_counter()
                await socket.emit("event", event | {"args": [f'"{name}"']})
                await asyncio.wait_for(answered.wait(), 60)
                self.events.append(time.perf_counter() - begin)
                answered.clear()
                begin = time.perf_counter()
                async with web.get(f"{self._server.root}files?path=none", headers=cookie) as answer:
                    await answer.read()
                self.requests.append(time.perf_counter() - begin)
                await asyncio.sleep(PAUSE_S)
            await socket.disconnect()
