"""Small pictures of the photographs, each made once: where it is searched for the board, or when it is asked for."""

import hashlib
import os
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from opencsp_calib.board import Board
from opencsp_calib.detection import Detection
from opencsp_calib.image import Image
from opencsp_calib.images import ImageFile, encode_thumbnail, read_image
from opencsp_calib.interfaces import Detector

__all__ = ["THUMBNAIL_PX", "KeepingThumbnails", "Thumbnails"]

THUMBNAIL_PX = 320


class Thumbnails:
    """Those in a folder.

    Parameters
    ----------
    folder : Path
        Made when there is something to put into it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def of(self, photograph: Path) -> bytes:
        """A photograph's, as JPEG.

        Raises
        ------
        InputError
            If it is no image.
        """
        kept = self._place(photograph)
        if kept.is_file():
            return kept.read_bytes()
        return self.keep(photograph, read_image(ImageFile(photograph.name, photograph)).pixels)

    def keep(self, photograph: Path, pixels: NDArray[Any]) -> bytes:
        """Make that of a photograph whose grey levels are known, and keep it."""
        kept = self._place(photograph)
        data = encode_thumbnail(pixels, THUMBNAIL_PX)
        self.folder.mkdir(parents=True, exist_ok=True)
        part = kept.with_suffix(f".{os.urandom(4).hex()}")
        part.write_bytes(data)
        part.replace(kept)
        return data

    def _place(self, photograph: Path) -> Path:
        stat = photograph.stat()
        key = f"{photograph} {stat.st_mtime_ns} {stat.st_size}".encode()
        return self.folder / f"{hashlib.sha256(key).hexdigest()[:32]}.jpg"


class KeepingThumbnails:
    """A detector that also keeps a thumbnail of each photograph that it is given; see `interfaces.Detector`."""

    def __init__(self, detector: Detector, thumbnails: Thumbnails, photographs: Mapping[str, Path]) -> None:
        self.name, self.feature = detector.name, detector.feature
        self.missing, self.supports = detector.missing, detector.supports
        self._detector, self._thumbnails, self._photographs = detector, thumbnails, photographs

    def detect(self, image: Image, board: Board) -> Detection:
        """What the detector finds."""
        with suppress(OSError):  # it is made when it is asked for
            self._thumbnails.keep(self._photographs[image.name], image.pixels)
        return self._detector.detect(image, board)
