"""Image sources that lie, one lie each."""

from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import pytest
from lies import Source, caught

from opencsp_calib.conformance import parametrize_checks
from opencsp_calib.errors import InputError
from opencsp_calib.image import Image


class OneBuffer(Source):
    def images(self):
        buffer = np.zeros((4, 6), dtype=np.uint8)
        for number in range(5):
            buffer[:] = number
            yield Image(f"{number}.png", buffer)


class OneName(Source):
    def images(self):
        return (replace(image, name="image.png") for image in super().images())


class Empty(Source):
    def images(self):
        return iter(())


class NeverLetsGo(Source):
    @contextmanager
    def open(self, device, **settings):
        if device != "one":
            raise InputError("no")
        if not self.lock.acquire(blocking=False):
            raise InputError("the device is in use")
        yield self.images()


class OpensAnything(Source):
    def open(self, device, **settings):
        return super().open("one", **settings)


class ListsTwice(Source):
    def devices(self):
        return ["one", "one"]


SOURCE_LIES = [
    (OneBuffer, "delivers_images"),
    (OneName, "delivers_images"),
    (Empty, "delivers_images"),
    (NeverLetsGo, "can_be_left_and_opened_again"),
    (OpensAnything, "refuses_an_unknown_device"),
    (ListsTwice, "lists_its_devices"),
]


@pytest.mark.parametrize(("liar", "check"), SOURCE_LIES, ids=lambda value: getattr(value, "__name__", value))
def test_a_lying_source_is_caught(liar, check):
    assert caught(liar(), check, device="one")


@parametrize_checks(Source(), device="one")
def test_without_a_lie_the_source_conforms(provided, check):
    check(provided)
