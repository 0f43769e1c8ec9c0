"""What was found in one photograph, what became of it, and the whole set: the input of every solver and report."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from typing import Literal, TypeAlias

import numpy as np

from opencsp_calib.arrays import Covariances, Floats, Ids, Mask, Pixels, frozen, frozen_ids
from opencsp_calib.board import Board
from opencsp_calib.errors import InputError

__all__ = ["Detection", "Observations", "Problem", "RejectedCorner", "Status", "View"]

Status: TypeAlias = Literal["used", "dropped", "no board", "unreadable", "wrong size", "duplicate"]


@dataclass(frozen=True)
class Problem:
    """Something a person should know, with what to do about it.

    Parameters
    ----------
    code : str
        Short, stable, for programs: ``too-few-views``.
    message : str
        One sentence or two, for people.
    """

    code: str
    message: str


@dataclass(frozen=True)
class RejectedCorner:
    """A place where a corner should be and none could be trusted.

    Parameters
    ----------
    id : int
    pixel : (float, float)
        Where it was looked for.
    reason : str
        Such as ``glare``, ``occluded``, ``at the image border``.
    """

    id: int
    pixel: tuple[float, float]
    reason: str


@dataclass(frozen=True, eq=False)
class Detection:
    """The corners found in one photograph; maybe none, with the reason.

    Parameters
    ----------
    ids : (n,) int
        Which of the board's corners; each at most once.
    pixels : (n, 2)
        Where they are; the centre of the upper-left pixel is (0, 0).
    covariance : (n, 2, 2) px², optional
    edge_width_px : (n,), optional
        Blur: the standard deviation of a Gaussian that makes edges this wide.
    contrast : (n,), optional
        White minus black around the corner, as a fraction of the image's range.
    rejected : tuple of RejectedCorner
    reason : str
        Why nothing, or not all, was found.
    other_board : bool
        Whether nothing was found because the whole of another board is in view, with more or fewer corners.
    """

    ids: Ids
    pixels: Pixels
    covariance: Covariances | None = None
    edge_width_px: Floats | None = None
    contrast: Floats | None = None
    rejected: tuple[RejectedCorner, ...] = ()
    reason: str = ""
    other_board: bool = False

    def __post_init__(self) -> None:
        object.__setattr__(self, "ids", frozen_ids(self.ids, "corner ids", (None,)))
        n = len(self.ids)
        object.__setattr__(self, "pixels", frozen(self.pixels, "corner pixels", (n, 2)))
        for name, shape in (("covariance", (n, 2, 2)), ("edge_width_px", (n,)), ("contrast", (n,))):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, frozen(value, f"corner {name}", shape))
        if len(np.unique(self.ids)) != n:
            raise InputError("a detection names the same corner twice")

    @classmethod
    def nothing(cls, reason: str, *, other_board: bool = False) -> "Detection":
        """No corner, and why."""
        return cls(np.empty(0, dtype=np.int64), np.empty((0, 2)), reason=reason, other_board=other_board)

    def __len__(self) -> int:
        return len(self.ids)

    def keeping(self, mask: Mask) -> "Detection":
        """Only the corners where the mask (n,) is true."""
        if len(mask) == len(self) and mask.all():
            return self

        def pick(values: Floats | None) -> Floats | None:
            return None if values is None else values[mask]

        return replace(
            self,
            ids=self.ids[mask],
            pixels=self.pixels[mask],
            covariance=pick(self.covariance),
            edge_width_px=pick(self.edge_width_px),
            contrast=pick(self.contrast),
        )


@dataclass(frozen=True, eq=False)
class View:
    """One photograph of the set, with what was found in it and what became of it.

    Parameters
    ----------
    image : str
        Its name, unique within the set.
    detection : Detection
    status : Status
        ``used``, ``dropped``, ``no board``, ``unreadable``, ``wrong size`` or ``duplicate``.
    problems : tuple of Problem
        What is wrong with it, used or not.
    sha256 : str
        Of the image file, hexadecimal.
    """

    image: str
    detection: Detection
    status: Status
    problems: tuple[Problem, ...] = ()
    sha256: str = ""


@dataclass(frozen=True, eq=False)
class Observations:
    """Everything that was seen of one board by one camera: the input of every solver and of every report.

    Parameters
    ----------
    board : Board
    image_size : (int, int)
        Width and height in pixels of the used views.
    views : tuple of View
        All images looked at, in order of capture.
    """

    board: Board
    image_size: tuple[int, int]
    views: tuple[View, ...] = field(repr=False)

    def __post_init__(self) -> None:
        names = [view.image for view in self.views]
        if len(set(names)) != len(names):
            raise InputError("two views of a set have the same name")
        corners = len(self.board.points)
        for view in self.used:
            if len(view.detection) and not (view.detection.ids.min() >= 0 and view.detection.ids.max() < corners):
                raise InputError(f"{view.image} names a corner that the board, with {corners} corners, does not have")

    @property
    def used(self) -> tuple[View, ...]:
        """The views that take part in the calibration."""
        return tuple(view for view in self.views if view.status == "used")

    @property
    def detections(self) -> tuple[Detection, ...]:
        """The detections of the used views."""
        return tuple(view.detection for view in self.used)

    def dropping(self, images: Iterable[str], problem: Problem | None = None) -> "Observations":
        """The same set with used views dropped by name, and why."""
        dropped = set(images)
        extra = (problem,) if problem else ()
        return self._with_views(
            lambda view: (
                replace(view, status="dropped", problems=view.problems + extra)
                if view.image in dropped and view.status == "used"
                else view
            )
        )

    def keeping(self, images: Iterable[str]) -> "Observations":
        """The same set where, of the used views, only the named ones stay used."""
        kept = set(images)
        return self.dropping(view.image for view in self.used if view.image not in kept)

    def with_board(self, board: Board) -> "Observations":
        """The same views of a board whose corners are elsewhere."""
        return replace(self, board=board)

    def _with_views(self, change: Callable[[View], View]) -> "Observations":
        return replace(self, views=tuple(change(view) for view in self.views))
