"""Promises of an image source: devices that can be opened, images that come as they were taken, and a clean end."""

from itertools import islice

from opencsp_calib.conformance.kit import Setup, promise
from opencsp_calib.errors import CalibError
from opencsp_calib.image import Image
from opencsp_calib.interfaces import ImageSource

__all__ = ["CHECKS"]

IMAGES = 3


def lists_its_devices(source: ImageSource, setup: Setup) -> None:
    """Texts, each once; none is no error."""
    devices = list(source.devices())
    promise(all(isinstance(d, str) and d for d in devices), f"devices are named by text, not {devices!r}")
    promise(len(set(devices)) == len(devices), f"a device is listed twice: {devices}")


def refuses_an_unknown_device(source: ImageSource, setup: Setup) -> None:
    """A CalibError of one line, before any image."""
    try:
        with source.open("no such device") as images:
            next(iter(images), None)
    except CalibError as error:
        promise(str(error).strip() and "\n" not in str(error), f"the message {str(error)!r} is not one line")
    except Exception as error:
        raise AssertionError(f"an unknown device raises {error!r}, not a CalibError") from error
    else:
        raise AssertionError("it opens a device that does not exist")


def delivers_images(source: ImageSource, setup: Setup) -> None:
    """Of one size, under names of their own, and not changed once they were handed over."""
    if setup.device is None:
        return
    with source.open(setup.device, **setup.settings) as images:
        taken = list(islice(images, IMAGES))
        before = [image.pixels.copy() for image in taken]
        list(islice(images, 1))
    promise(taken, f"the device {setup.device!r} delivers no image")
    promise(all(isinstance(image, Image) for image in taken), "what it delivers is no Image")
    names = [image.name for image in taken]
    promise(len(set(names)) == len(names) and all(names), f"images need names of their own, not {names}")
    promise(len({image.size for image in taken}) == 1, "images of one device differ in size")
    same = all((image.pixels == old).all() for image, old in zip(taken, before, strict=True))
    promise(same, "an image changes after it was handed over: copy the vendor's buffer")


def can_be_left_and_opened_again(source: ImageSource, setup: Setup) -> None:
    """Left after one image, also by an error, the device is free again."""
    if setup.device is None:
        return
    try:
        with source.open(setup.device, **setup.settings) as images:
            next(iter(images))
            raise InterruptedError
    except InterruptedError:
        pass
    with source.open(setup.device, **setup.settings) as images:
        promise(next(iter(images), None) is not None, "opened a second time, the device delivers nothing")


CHECKS = (lists_its_devices, refuses_an_unknown_device, delivers_images, can_be_left_and_opened_again)
