"""All corners of all used views in one table, with their weights: what a calibration is solved from."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Mask, Pixels
from opencsp_calib.detection import Detection
from opencsp_calib.options import Weights

__all__ = ["CornerTable"]

LEAST = 40  # corners of a view: enough for its pose, whatever is wrong with a few of them
CHUNK = 4096  # corners linearised at once: their Jacobians stay in the processor's cache


@dataclass(frozen=True, eq=False)
class CornerTable:
    """Every corner seen in the used views, view after view.

    Parameters
    ----------
    ids : (N,) int
    pixels : (N, 2) px
    first : (V + 1,) int
        Corners ``first[v]`` to ``first[v + 1]`` are of view v.
    whitening : (N, 2, 2), optional
        What residuals are multiplied by before they are squared: lower triangular W with WᵀW the inverse of the
        corner's covariance; None for the identity.
    """

    ids: Ids
    pixels: Pixels
    first: Ids
    whitening: Floats | None = None

    @classmethod
    def of(cls, detections: Sequence[Detection], weights: Weights = "equal") -> "CornerTable":
        """The corners of detections, weighted ``equal`` or by their ``covariance`` where they have one."""
        counts = [len(detection) for detection in detections]
        return cls(
            np.concatenate([d.ids for d in detections]) if detections else np.empty(0, dtype=np.int64),
            np.concatenate([d.pixels for d in detections]) if detections else np.empty((0, 2)),
            np.concatenate([[0], np.cumsum(counts)]).astype(np.int64),
            _whitening(detections) if weights == "covariance" else None,
        )

    def __len__(self) -> int:
        return len(self.ids)

    @property
    def counts(self) -> Ids:
        """(V,) corners of each view."""
        return np.diff(self.first)

    @property
    def view(self) -> Ids:
        """(N,) the view of each corner."""
        return np.repeat(np.arange(len(self.first) - 1), self.counts)

    @property
    def typical_weight(self) -> float:
        """What a residual in pixels is typically multiplied by: the median over corners and axes."""
        return 1.0 if self.whitening is None else float(np.median(self.whitening[:, [0, 1], [0, 1]]))

    def keeping(self, mask: Mask) -> "CornerTable":
        """Only the corners where the mask (N,) is true; a view may be left with none."""
        if mask.all():
            return self
        first = np.concatenate([[0], np.cumsum(mask)])[self.first].astype(np.int64)
        whitening = None if self.whitening is None else self.whitening[mask]
        return CornerTable(self.ids[mask], self.pixels[mask], first, whitening)

    def in_views(self, views: slice) -> Mask:
        """(N,) which corners are of the views that a slice takes."""
        taken = np.zeros(len(self.counts), dtype=np.bool_)
        taken[views] = True
        return taken[self.view]

    def of_views(self, views: slice) -> "CornerTable":
        """Only the views that a slice takes, in the order they are in."""
        first = np.concatenate([[0], np.cumsum(self.counts[views])]).astype(np.int64)
        return replace(self.keeping(self.in_views(views)), first=first)

    def thinned(self, count: int) -> "CornerTable":
        """About as many corners, some of every view: the same share of each, but at least `LEAST` where it has them.

        Drawn at random, but always the same: every n-th could be all on one line.
        """
        if len(self) <= count:
            return self
        wanted = np.ceil(np.maximum(LEAST, count / len(self) * self.counts)).astype(np.int64)
        random, mask = np.random.default_rng(len(self)), np.zeros(len(self), dtype=np.bool_)
        for first, size, some in zip(self.first, self.counts, wanted, strict=False):
            mask[first + random.permutation(size)[:some]] = True
        return self.keeping(mask)

    def whitened(self, residuals: Floats) -> Floats:
        """Residuals (N, 2) px over the standard deviations of the corners."""
        return residuals if self.whitening is None else np.einsum("nij,nj->ni", self.whitening, residuals)

    def weighted(self, factor: Floats) -> "CornerTable":
        """The same with each corner's whitened residual multiplied by a factor (N,)."""
        whitening = np.eye(2) if self.whitening is None else self.whitening
        return replace(self, whitening=factor[:, None, None] * whitening)

    def split(self, mask: Mask) -> tuple[Mask, ...]:
        """A mask (N,) as one of each view."""
        return tuple(np.split(mask, self.first[1:-1]))

    def span(self, begin: int, end: int, *, since: int = 0) -> slice:
        """Where the corners of a run of views are, counted from those of the view `since`."""
        offset = self.first[since]
        return slice(int(self.first[begin] - offset), int(self.first[end] - offset))

    def chunks(self, begin: int = 0, last: int | None = None) -> Iterator[tuple[int, int]]:
        """First view and end of runs of views with about `CHUNK` corners, or one view where that has more."""
        last = len(self.first) - 1 if last is None else last
        while begin < last:
            end = max(begin + 1, int(np.searchsorted(self.first, self.first[begin] + CHUNK, side="right")) - 1)
            yield begin, min(end, last)
            begin = end


def _whitening(detections: Sequence[Detection]) -> Floats:
    """(N, 2, 2): by covariance; a corner without a usable one counts as the typical one of the others."""
    covariances = np.concatenate(
        [np.full((len(d), 2, 2), np.nan) if d.covariance is None else d.covariance for d in detections]
    )
    xx, xy, yy = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    with np.errstate(invalid="ignore"):
        usable = (xx * yy - xy * xy > 0) & (xx > 0)
    if not usable.all():
        typical = np.median(covariances[usable][:, [0, 1], [0, 1]]) if usable.any() else 1.0
        covariances[~usable] = typical * np.eye(2)
    # the inverse of each Cholesky factor, in closed form, as LAPACK takes ten times as long for such small ones; and in
    # the same memory
    covariances[:, 1, 1] = 1.0 / np.sqrt(yy - xy * xy / xx)
    covariances[:, 1, 0] = -xy / xx * yy
    covariances[:, 0, 0] = 1.0 / np.sqrt(xx)
    covariances[:, 0, 1] = 0.0
    return covariances
