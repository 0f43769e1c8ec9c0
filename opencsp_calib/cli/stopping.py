"""Being told to stop: a signal becomes KeyboardInterrupt, so that every file under way is cleaned up."""

import signal
from types import FrameType

__all__ = ["stop_when_told"]

SIGNALS = ("SIGTERM", "SIGHUP", "SIGBREAK")  # a service manager, a closed terminal, Windows


def stop_when_told() -> None:
    """Have each of the signals end the program as Ctrl-C does; one that is ignored, as under nohup, stays so."""
    for name in SIGNALS:
        number = getattr(signal, name, None)
        if number is not None and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _interrupt)


def _interrupt(number: int, _: FrameType | None) -> None:
    signal.signal(number, signal.SIG_DFL)  # who asks twice does not want to wait
    raise KeyboardInterrupt
