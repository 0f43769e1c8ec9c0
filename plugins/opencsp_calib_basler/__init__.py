"""Basler cameras as a plugin: an image source on Basler's SDK, pylon."""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import ImageSource

__all__ = ["image_sources"]


@hookimpl
def image_sources() -> Iterator[ImageSource]:
    """The image source ``basler``."""
    from opencsp_calib_basler.source import BaslerSource

    yield BaslerSource()
