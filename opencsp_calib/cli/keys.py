"""Keys pressed while a capture runs: single keys on a terminal, lines where input comes from a program."""

import contextlib
import os
import sys
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager

__all__ = ["keys_pressed"]

SPACE, ENTER = " ", "\r"


@contextmanager
def keys_pressed(actions: Mapping[str, Callable[[], None]]) -> Iterator[None]:
    """Have actions run when their keys are pressed; Enter counts as the space bar.

    Parameters
    ----------
    actions : mapping of str to callable
        By key: one character each.
    """

    def act(key: str) -> None:
        action = actions.get(SPACE if key in (ENTER, "\n") else key.lower())
        if action:
            action()

    with _single_keys() as read_key:
        threading.Thread(target=_listen, args=(read_key, act), daemon=True, name="keys").start()
        yield


def _listen(read_key: Callable[[], str], act: Callable[[str], None]) -> None:
    while True:
        try:
            key = read_key()
        except OSError:  # no input, as in the background
            return
        if not key:
            return
        act(key)


@contextmanager
def _single_keys() -> Iterator[Callable[[], str]]:
    """A function that waits for a key; on a terminal without Enter, which is put back to normal afterwards."""
    if sys.stdin is None or sys.stdin.closed:
        yield lambda: ""
        return
    try:
        number = sys.stdin.fileno()
    except OSError:  # not a real one
        yield lambda: ""
        return
    if not sys.stdin.isatty():
        yield lambda: os.read(number, 1).decode(errors="replace")
        return
    if sys.platform == "win32":
        import msvcrt

        yield msvcrt.getwch
        return
    import termios
    import tty

    before = termios.tcgetattr(number)
    tty.setcbreak(number)
    try:
        yield lambda: os.read(number, 1).decode(errors="replace")
    finally:
        with contextlib.suppress(termios.error):
            termios.tcsetattr(number, termios.TCSADRAIN, before)
