"""Being told to stop: a signal becomes KeyboardInterrupt, so that every file under way is cleaned up."""

import signal
from collections.abc import Callable
from types import FrameType

__all__ = ["stop_when_told", "was_told"]

SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")  # Ctrl-C, a service manager, a closed terminal, Windows


def was_told() -> bool:
    """Whether one of the signals came: what is raised then may be a library's version of KeyboardInterrupt."""
    return bool(_told)


_told: list[int] = []


def _interrupt(number: int, _: FrameType | None) -> None:
    _told.append(number)
    signal.signal(number, signal.SIG_DFL)  # who asks twice does not want to wait
    raise KeyboardInterrupt


def stop_when_told(how: Callable[[int, FrameType | None], None] = _interrupt) -> None:
    """Have each of the signals end the program by KeyboardInterrupt; one that is ignored, as under nohup, stays so.

    Parameters
    ----------
    how : callable, optional
        What ends the program instead, where something else runs it.
    """
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, how)
