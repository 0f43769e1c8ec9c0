"""A folder that another program fills, as a source of images: so any camera serves that has software of its own."""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import ImageSource

__all__ = ["image_sources"]


@hookimpl
def image_sources() -> Iterator[ImageSource]:
    """The image source ``folder``."""
    from opencsp_calib_folder.source import FolderSource

    yield FolderSource()
