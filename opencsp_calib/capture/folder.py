"""The photographs of a capture on disk: ``0001.png``, ``0002.png`` ..., each with a record of what took it, as JSON.

An image is written aside, flushed to the disk and then given its name, so that whatever happens, a file of that name is
whole. The record comes after its image; one that is missing costs nothing but itself.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timezone
from pathlib import Path
from typing import Any

from opencsp_calib.atomic import replacing
from opencsp_calib.errors import InputError
from opencsp_calib.image import Image
from opencsp_calib.images import images_in, write_image

__all__ = ["CaptureFolder"]

ABOUT = "capture.json"
MAX_RECORD_BYTES = 1_000_000


@dataclass(frozen=True)
class CaptureFolder:
    """A folder that photographs are taken into.

    Parameters
    ----------
    path : Path
    about : mapping
        What all of them have in common: board, source, device.
    """

    path: Path
    about: Mapping[str, str]

    @classmethod
    def opened(cls, path: Path, board: str, source: str, device: str) -> "CaptureFolder":
        """A new folder, or one that a capture stopped in.

        Raises
        ------
        InputError
            If it cannot be made, or holds photographs of another board.
        """
        try:
            path.mkdir(parents=True, exist_ok=True)
            for left in path.glob(".writing-*"):  # from a capture that was killed
                left.unlink(missing_ok=True)
        except OSError as error:
            raise InputError(f"cannot take photographs into {path}: {error.strerror}") from None
        before = _read(path / ABOUT)
        if before.get("board", board) != board:
            raise InputError(
                f"{path} has photographs of another board, {before['board']}; take those of {board} into another folder"
            )
        folder = cls(path, {"board": board, "source": source, "device": device})
        if before != folder.about:
            _write(path / ABOUT, folder.about)
        return folder

    @property
    def images(self) -> tuple[Path, ...]:
        """The photographs, in the order in which they were taken."""
        return tuple(images_in(self.path))

    @property
    def sources(self) -> frozenset[str]:
        """SHA-256 of the files that were copied here: an image that another program left is not taken twice."""
        records = (_read(path.with_suffix(".json")) for path in self.images)
        return frozenset(str(record["source_sha256"]) for record in records if record.get("source_sha256"))

    def add(self, image: Image) -> Path:
        """Write a photograph, losslessly, and its record.

        Raises
        ------
        InputError
            If it cannot be written, as where the disk is full; what was written before is untouched.
        """
        taken = datetime.now(timezone.utc)  # before it is written, which may take a while
        path = self.path / f"{self._last_number() + 1:04d}.png"
        write_image(image.pixels, path)
        record = {
            "image": path.name,
            "time": taken.isoformat(timespec="milliseconds"),
            **self.about,
            "source_image": image.name,
            "source_sha256": image.sha256,
            "settings": dict(image.record),
        }
        _write(path.with_suffix(".json"), record)
        return path

    def remove_last(self) -> Path | None:
        """Delete the last photograph; gives its path, or None where there is none.

        An image that somebody else put into the folder is not a photograph of this capture, and stays.
        """
        numbered = [path for path in self.images if path.stem.isdecimal()]
        if not numbered:
            return None
        path = max(numbered, key=lambda one: int(one.stem))
        try:
            path.with_suffix(".json").unlink(missing_ok=True)
            path.unlink()
        except OSError as error:
            raise InputError(f"cannot delete {path}: {error.strerror}") from None
        return path

    def _last_number(self) -> int:
        return max((int(path.stem) for path in self.images if path.stem.isdecimal()), default=0)


def _write(path: Path, content: Mapping[str, Any]) -> None:
    with replacing(path) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def _read(path: Path) -> dict[str, Any]:
    """A record; empty where there is none, or it is damaged."""
    try:
        if path.stat().st_size > MAX_RECORD_BYTES:
            return {}
        content = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}
