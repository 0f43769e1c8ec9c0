"""What the line at the foot of the page tells: what happened last, or how far the work is."""

import time
from dataclasses import dataclass, field
from typing import Literal, TypeAlias

__all__ = ["Level", "Message", "Progress"]

Level: TypeAlias = Literal["info", "good", "bad"]


@dataclass(frozen=True)
class Message:
    """The line that says what happened last."""

    text: str
    level: Level = "info"


@dataclass(frozen=True)
class Progress:
    """The work that is going on."""

    what: str
    done: int = 0
    total: int = 0
    started: float = field(default_factory=time.monotonic)

    @property
    def seconds_left(self) -> float | None:
        """As the work so far lets expect; None where that is too little."""
        if self.done < 2:
            return None
        return (time.monotonic() - self.started) / self.done * (self.total - self.done)
