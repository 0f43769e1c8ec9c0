"""Readers and writers of other programs' camera files, one file a format, that need no vendor's library."""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import CameraFormat


@hookimpl
def camera_formats() -> Iterator[CameraFormat]:
    """All formats of this plugin."""
    yield from ()
