"""All corners of all used views, with their weights: what a calibration is solved from."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from opencsp_calib.arrays import Covariances, Floats, Ids, Mask, Pixels
from opencsp_calib.detection import Detection
from opencsp_calib.options import Weights

__all__ = ["CornerTable"]

LEAST = 40  # corners of a view: enough for its pose, whatever is wrong with a few of them
CHUNK = 4096  # corners linearised at once: their Jacobians stay in the processor's cache


@dataclass(frozen=True, eq=False)
class CornerTable:
    """Every corner seen in the used views, view after view, where detections have them: none is copied.

    Parameters
    ----------
    detections : tuple of Detection
        One per view.
    variance : float, optional
        px², of corners that have no usable covariance; None where covariances do not count.
    factors : (N,), optional
        What whitened residuals are multiplied by besides.
    """

    detections: tuple[Detection, ...]
    variance: float | None = None
    factors: Floats | None = None

    @classmethod
    def of(cls, detections: Sequence[Detection], weights: Weights = "equal") -> "CornerTable":
        """The corners of detections, weighted ``equal`` or by their ``covariance`` where they have one."""
        return cls(tuple(detections), _typical_variance(detections) if weights == "covariance" else None)

    def __len__(self) -> int:
        return int(self.first[-1])

    @cached_property
    def first(self) -> Ids:
        """(V + 1,) where views begin: corners ``first[v]`` to ``first[v + 1]`` are of view v."""
        return np.cumsum([0, *map(len, self.detections)])

    @property
    def counts(self) -> Ids:
        """(V,) corners of each view."""
        return np.diff(self.first)

    @property
    def view(self) -> Ids:
        """(N,) the view of each corner."""
        return np.repeat(np.arange(len(self.detections)), self.counts)

    @property
    def ids(self) -> Ids:
        """(N,)."""
        return self.ids_of(0, len(self.detections))

    @property
    def pixels(self) -> Pixels:
        """(N, 2) px."""
        return self.pixels_of(0, len(self.detections))

    def ids_of(self, begin: int, end: int) -> Ids:
        """(n,) those of a run of views."""
        return np.concatenate([np.empty(0, dtype=np.int64), *(d.ids for d in self.detections[begin:end])])

    def pixels_of(self, begin: int, end: int) -> Pixels:
        """(n, 2) px those of a run of views."""
        return np.concatenate([np.empty((0, 2)), *(d.pixels for d in self.detections[begin:end])])

    def whitening(self, begin: int, end: int) -> Floats | None:
        """(2, 2, n) what the residuals of a run of views are multiplied by before they are squared.

        Lower triangular W with WᵀW the inverse of the corner's covariance; None for the identity.
        """
        factors = None if self.factors is None else self.factors[self.span(begin, end)]
        if self.variance is None:
            return None if factors is None else factors * np.eye(2)[:, :, None]
        unknown = self.variance * np.eye(2)
        covariances = np.concatenate(
            [
                np.tile(unknown, (len(d), 1, 1)) if d.covariance is None else d.covariance
                for d in self.detections[begin:end]
            ]
        )
        usable = _usable(covariances)
        if not usable.all():
            covariances[~usable] = unknown
        # the inverse of each Cholesky factor, in closed form: LAPACK takes ten times as long for such small ones
        xx, xy, yy = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
        whitening = np.zeros((2, 2, len(covariances)))
        whitening[0, 0] = 1.0 / np.sqrt(xx)
        whitening[1, 1] = 1.0 / np.sqrt(yy - xy * xy / xx)
        whitening[1, 0] = -xy / xx * whitening[1, 1]
        return whitening if factors is None else whitening * factors

    def whitened_lengths(self, residuals: Floats) -> Floats:
        """(N,) of residuals (N, 2) px, multiplied by what they are before they are squared."""
        found = np.empty(len(self))
        for run in self.chunks():
            whitening, span = self.whitening(*run), self.span(*run)
            here = residuals[span] if whitening is None else np.einsum("ijn,nj->ni", whitening, residuals[span])
            found[span] = np.hypot(*here.T)
        return found

    @cached_property
    def typical_weight(self) -> float:
        """What a residual in pixels is typically multiplied by: the median over corners and axes."""
        weights = [
            whitening[[0, 1], [0, 1]] for run in self.chunks() if (whitening := self.whitening(*run)) is not None
        ]
        return float(np.median(np.concatenate(weights, axis=1))) if weights else 1.0

    def keeping(self, mask: Mask) -> "CornerTable":
        """Only the corners where the mask (N,) is true; a view may be left with none."""
        if mask.all():
            return self
        kept = tuple(d.keeping(some) for d, some in zip(self.detections, self.split(mask), strict=True))
        return replace(self, detections=kept, factors=None if self.factors is None else self.factors[mask])

    def in_views(self, views: slice) -> Mask:
        """(N,) which corners are of the views that a slice takes."""
        taken = np.zeros(len(self.counts), dtype=np.bool_)
        taken[views] = True
        return np.repeat(taken, self.counts)

    def of_views(self, views: slice) -> "CornerTable":
        """Only the views that a slice takes, in the order they are in."""
        factors = None if self.factors is None else self.factors[self.in_views(views)]
        return replace(self, detections=self.detections[views], factors=factors)

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

    def weighted(self, factors: Floats) -> "CornerTable":
        """The same with each corner's whitened residual multiplied by a factor (N,)."""
        return replace(self, factors=factors)

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


def _typical_variance(detections: Sequence[Detection]) -> float:
    """Px² the median over corners and axes; 1 where no corner has a usable covariance."""
    diagonals, end = np.empty((sum(map(len, detections)), 2)), 0
    for detection in detections:
        if detection.covariance is not None:
            known = detection.covariance[:, [0, 1], [0, 1]][_usable(detection.covariance)]
            diagonals[end : end + len(known)] = known
            end += len(known)
    return float(np.median(diagonals[:end], overwrite_input=True)) if end else 1.0


def _usable(covariances: Covariances) -> Mask:
    """(N,) which are positive definite."""
    xx, xy, yy = covariances[:, 0, 0], covariances[:, 0, 1], covariances[:, 1, 1]
    return np.asarray((xx * yy - xy * xy > 0) & (xx > 0))
