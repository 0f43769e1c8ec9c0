"""When the shutter is released: when the coach finds it right, every so many seconds, or by hand."""

import math
from dataclasses import dataclass
from typing import Literal

from opencsp_calib.errors import InputError

__all__ = ["Release", "release_from"]


@dataclass(frozen=True)
class Release:
    """How photographs are released.

    Parameters
    ----------
    by : 'coach', 'interval' or 'manual'
        By hand always works too.
    seconds : float
        Of an interval; 0 takes every image.
    """

    by: Literal["coach", "interval", "manual"]
    seconds: float = 0.0

    def due(self, *, right: bool, pressed: bool, since_s: float) -> bool:
        """Whether to release now.

        Parameters
        ----------
        right : bool
            What the coach says of this frame.
        pressed : bool
            Whether somebody asked for it.
        since_s : float
            Seconds since the last one; infinite before the first.
        """
        if pressed:
            return True
        if self.by == "interval":
            return since_s >= self.seconds
        return self.by == "coach" and right


def release_from(text: str) -> Release:
    """What ``--release`` says.

    Raises
    ------
    InputError
    """
    kind, _, number = text.partition(":")
    if text in ("coach", "manual"):
        return Release(text)  # type: ignore[arg-type]  # one of the two
    try:
        seconds = float(number) if kind == "interval" else math.nan
    except ValueError:
        seconds = math.nan
    if not (math.isfinite(seconds) and seconds >= 0):
        raise InputError(f"--release takes coach, manual or interval:SECONDS, such as interval:2, not {text!r}")
    return Release("interval", seconds)
