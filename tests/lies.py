"""What the tests of the conformance kit share: what a check says of a liar, and an image source that does not lie."""

import threading
from contextlib import contextmanager

import numpy as np

from opencsp_calib.conformance import checks_of
from opencsp_calib.errors import InputError
from opencsp_calib.image import Image


def caught(liar, check: str, **setup) -> str:
    """What the check says of the liar; fails where it says nothing."""
    import pytest  # here: a check loads this module in a process of its own, and looks at what comes with it

    found = {c.name: c for c in checks_of(liar, **setup)}[check]
    with pytest.raises(AssertionError) as said:
        found(liar)
    return str(said.value)


class Source:
    """A device that counts, and no lie."""

    name = "counter"

    def __init__(self):
        self.lock = threading.Lock()

    def missing(self):
        return None

    def devices(self):
        return ["one"]

    @contextmanager
    def open(self, device, **settings):
        if device != "one":
            raise InputError(f"there is no device {device!r}")
        if not self.lock.acquire(blocking=False):
            raise InputError("the device is in use")
        try:
            yield self.images()
        finally:
            self.lock.release()

    def images(self):
        for number in range(5):
            yield Image(f"{number}.png", np.full((4, 6), number, dtype=np.uint8))
