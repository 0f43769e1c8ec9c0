"""Looking for a board in one photograph: reading, finding, refining, judging; the same wherever it is done."""

import hashlib
import json
from dataclasses import dataclass, replace
from functools import cache
from importlib.metadata import entry_points, version
from typing import Literal, TypeAlias

from opencsp_calib.board import Board
from opencsp_calib.corners import refine as refine_by_model
from opencsp_calib.detection import Detection, Problem, View
from opencsp_calib.errors import InputError
from opencsp_calib.hookspecs import GROUP
from opencsp_calib.image import Image
from opencsp_calib.images import EncodedImage, decode_image
from opencsp_calib.interfaces import Detector
from opencsp_calib.opencv import opencv_version
from opencsp_calib.photograph import problems_of
from opencsp_calib.subpix import refine_subpix

__all__ = ["OTHER_BOARD", "Look", "Refine", "Search", "engine_versions", "find_board"]

OTHER_BOARD = "other-board"  # the problem of a view that shows the whole of another board
MIN_CORNERS = 6  # twelve numbers for the six of a pose: as many again to check it by

Refine: TypeAlias = Literal["none", "subpix", "model"]


@dataclass(frozen=True, eq=False)
class Look:
    """A view, and the size of its image if that could be read."""

    view: View
    size: tuple[int, int] | None

    @classmethod
    def unreadable(cls, name: str, reason: str) -> "Look":
        """Of a file that is no image."""
        return cls(View(name, Detection.nothing(reason), "unreadable", (Problem("unreadable", reason),)), None)


@dataclass(frozen=True, eq=False)
class Search:
    """What to look for in photographs, and how.

    Parameters
    ----------
    board : Board
    detector : Detector
    refine : 'none', 'subpix' or 'model'
    """

    board: Board
    detector: Detector
    refine: Refine

    @property
    def key(self) -> str:
        """Hexadecimal SHA-256 of all that decides what is found: two searches of one key find the same in an image."""
        settings = [self.board.spec, self.detector.name, self.refine, engine_versions()]
        return hashlib.sha256(json.dumps(settings).encode() + self.board.points.tobytes()).hexdigest()

    def look(self, encoded: EncodedImage) -> Look:
        """What is found in an image file; it never fails, whatever the file is."""
        name = encoded.file.name
        try:
            image = decode_image(encoded)
        except InputError as error:
            return Look.unreadable(name, str(error))
        detection = find_board(image, self.board, self.detector, self.refine)
        if not len(detection):
            code = OTHER_BOARD if detection.other_board else "no-board"
            problems: tuple[Problem, ...] = (Problem(code, detection.reason),)
            return Look(View(name, detection, "no board", problems, image.sha256), image.size)
        problems = problems_of(image, detection, self.board)
        return Look(View(name, detection, "used", problems, image.sha256), image.size)


def find_board(image: Image, board: Board, detector: Detector, refine: Refine) -> Detection:
    """The board's corners in an image, refined; nothing, with the reason, where they are too few."""
    try:
        found = detector.detect(image, board)
    except Exception as error:  # a stranger's code: one image must not stop the run
        return Detection.nothing(f"the detector {detector.name!r} failed: {error!r}")
    if not len(found):
        return found
    if refine == "subpix":
        found = refine_subpix(image, found)
    elif refine == "model":
        found = refine_by_model(image, found, board)
    if len(found) < MIN_CORNERS:
        reason = f"only {len(found)} of {len(board.points)} corners can be trusted"
        return replace(Detection.nothing(reason), rejected=found.rejected)
    return found


@cache
def engine_versions() -> dict[str, str]:
    """The versions of everything that has a hand in finding corners."""
    plugins = {point.dist.name: point.dist.version for point in entry_points(group=GROUP) if point.dist}
    engines = {name: version(name) for name in ("opencsp-calib", "numpy", "scipy")}
    return dict(sorted({**plugins, **engines, "opencv": opencv_version()}.items()))
