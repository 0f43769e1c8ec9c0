"""The image source ``folder``: the images in a folder, then those that come, in order."""

import logging
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from opencsp_calib import Image, InputError
from opencsp_calib.images import ImageFile, images_in, read_image

__all__ = ["FolderSource"]

log = logging.getLogger("opencsp_calib.folder")

POLL_S = 0.1
SETTLED_S = 1.0  # a file changed this recently is looked at twice: another program may be writing it
GIVEN_UP_S = 5.0  # an image that cannot be read for so long is not being written any more
WAIT_S = 60.0


class FolderSource:
    """A folder, by its path, that a camera's own program or a person puts photographs into.

    Images that are there come first, in natural order; then each new one as soon as it is whole. None is left out. It
    ends when no file is half written and nothing new has come for a minute, or for the seconds of the setting ``wait``.
    """

    name = "folder"

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        return None

    def devices(self) -> Sequence[str]:
        """None: any folder will do."""
        return ()

    @contextmanager
    def open(self, device: str, **settings: Any) -> Iterator[Iterator[Image]]:
        """The images of a folder; InputError where there is no such folder, or a setting is not ``wait``."""
        folder = Path(device)
        if not device or not folder.is_dir():
            raise InputError(f"there is no folder {device!r} to take images from; name it with --device")
        unknown = sorted(set(settings) - {"wait"})
        if unknown:
            raise InputError(f"a folder has no setting {unknown[0]!r}, only wait, such as wait=60 (seconds)")
        yield _images(folder, _seconds(settings.get("wait", WAIT_S)))


def _seconds(value: Any) -> float:
    try:
        seconds = float(value)
    except (TypeError, ValueError):
        seconds = -1.0
    if not 0 <= seconds < float("inf"):
        raise InputError(f"wait takes a number of seconds, not {value!r}")
    return seconds


def _images(folder: Path, wait_s: float) -> Iterator[Image]:
    done: set[Path] = set()
    growing: dict[Path, Growing] = {}
    last = time.monotonic()
    while True:
        growing = {path: growing.get(path) or Growing(path) for path in _there(folder) if path not in done}
        for path, file in growing.items():
            image = file.whole_image()
            if image is not None:
                yield image
            if image is not None or file.given_up:
                done.add(path)
                last = time.monotonic()
        if growing.keys() <= done and time.monotonic() - last >= wait_s:
            break
        time.sleep(POLL_S)
    log.info("no new image in %s for %g s", folder, wait_s)


def _there(folder: Path) -> list[Path]:
    try:
        return images_in(folder)
    except OSError as error:  # a drive that was pulled, a folder that was deleted
        raise InputError(f"the folder {folder} cannot be read any more: {error.strerror}") from None


class Growing:
    """A file that another program may still be writing."""

    def __init__(self, path: Path) -> None:
        self.path, self.given_up = path, False
        self._size, self._since = -1, 0.0

    def whole_image(self) -> Image | None:
        """The image, once the file does not grow any more and can be read."""
        now = time.monotonic()
        try:
            state = self.path.stat()
        except OSError:  # taken away again
            return None
        if state.st_size != self._size:
            fresh = abs(time.time() - state.st_mtime) < SETTLED_S
            self._size, self._since = state.st_size, now
            if fresh:
                return None
        try:
            return read_image(ImageFile(self.path.name, self.path))
        except InputError as error:
            if now - self._since > GIVEN_UP_S:
                log.warning("%s; it is left out", error)
                self.given_up = True
            return None
