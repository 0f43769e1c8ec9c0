"""Loading the window quickly: its first page is there only when all of NiceGUI is."""

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

__all__ = ["serve"]

CLIENTS = ("aiohttp", "requests", "tornado", "websocket")
"""What NiceGUI's library of websockets uses where it is there; a server needs none of it."""


def serve(folder: Path, host: str, port: int, *, open_browser: bool) -> None:
    """Load what `server.serve` needs, then do what it does, unless the folder has a window already."""
    gc.disable()  # loading makes very many objects and no garbage, and looking for some takes a tenth of its time
    with _absent(CLIENTS):  # a sixth of it
        from opencsp_calib.gui import one_window, server
    gc.freeze()  # nor is there any later among what is loaded; looking would hold up answers to the page
    gc.enable()
    with one_window.only_window(folder):
        server.serve(folder, host, port, open_browser=open_browser)


@contextmanager
def _absent(names: tuple[str, ...]) -> Iterator[None]:
    """As if these modules were not installed; what is loaded already stays."""
    hidden = [name for name in names if name not in sys.modules]
    for name in hidden:
        sys.modules[name] = None  # type: ignore[assignment]  # makes an import of it an ImportError
    try:
        yield
    finally:
        for name in hidden:
            del sys.modules[name]
