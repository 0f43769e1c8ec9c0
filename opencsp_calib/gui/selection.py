"""Which photographs are selected: those that came by upload, and those in folders below DIR."""

import shutil
from pathlib import Path

from opencsp_calib.errors import InputError
from opencsp_calib.gui.files import images_in, shown, within
from opencsp_calib.images import ImageFile, find_images, natural_order

__all__ = ["Selection"]


class Selection:
    """The photographs, and the uploads that are on their way.

    Parameters
    ----------
    folder : Path
        Below which all files are.
    uploads : Path
        Where uploads are kept.
    """

    def __init__(self, folder: Path, uploads: Path) -> None:
        self.folder, self.uploads = folder, uploads
        self.sources: tuple[str, ...] = ()
        self.files: tuple[ImageFile, ...] = ()
        self.paths: dict[str, Path] = {}  # by what a photograph is called
        self.receiving: dict[str, tuple[int, int]] = {}  # batches: how many have come, how many there will be
        self._over: set[str] = set()  # batches of which no more will come, though one may still be on its way

    def add(self, text: str) -> tuple[str, int]:
        """Take the photographs in a folder, or one file; gives what it is called, and how many there are.

        Raises
        ------
        InputError
            If it is outside of DIR, or there are none.
        """
        source = shown(self.folder, within(self.folder, text))
        count = len(images_in(self.folder, [source]))
        self.sources = (*(s for s in self.sources if s != source), source)
        self.look_up()
        return source, count

    def clear(self) -> None:
        """None are selected; those that came by upload are copies, and are deleted."""
        self.sources = ()
        shutil.rmtree(self.uploads, ignore_errors=True)
        self.look_up()

    def begin(self, batch: str, count: int) -> None:
        """So many files are about to come."""
        if batch not in self._over:
            self.receiving.setdefault(batch, (0, count))

    def received(self, batch: str, count: int) -> bool:
        """One more file of a batch has come, or is given up; whether it was the last."""
        if batch in self._over:
            return False
        done = self.receiving.get(batch, (0, 0))[0] + 1
        self.receiving[batch] = (done, count)
        return done >= count

    def end(self, batch: str) -> bool:
        """No more files of a batch will come: it is complete, or its page is gone; whether it was still open."""
        self._over.add(batch)
        was_open = self.receiving.pop(batch, None) is not None
        if was_open:
            self.look_up()
        return was_open

    def look_up(self) -> tuple[str, ...]:
        """See which photographs there are now; gives what is wrong with the sources that are left out for it."""
        uploaded = sorted(self.uploads.iterdir(), key=natural_order) if self.uploads.is_dir() else []
        paths, wrong, kept = list(uploaded), [], []
        for source in self.sources:
            try:
                paths += [file.path for file in images_in(self.folder, [source])]
                kept.append(source)
            except InputError as error:
                wrong.append(str(error))
        self.sources = tuple(kept)
        paths = list(dict.fromkeys(path.resolve() for path in paths))
        self.files = find_images(paths) if paths else ()
        self.paths = {file.name: file.path for file in self.files}
        return tuple(wrong)

    def provenance(self) -> dict[str, dict[str, str]]:
        """Where all of them are, as `pipeline.places_of`."""
        return {"images": {name: str(path.absolute()) for name, path in self.paths.items()}}
