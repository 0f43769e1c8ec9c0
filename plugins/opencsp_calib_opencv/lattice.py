"""Corners joined to grids: each to its neighbour along a common edge, then counted off in columns and rows."""

from collections import deque
from collections.abc import Iterator, Sequence
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats, Mask
from opencsp_calib_opencv.neighbours import Neighbours
from opencsp_calib_opencv.rings import sample
from opencsp_calib_opencv.saddles import Saddles

__all__ = ["grids", "links"]

NEAREST = 12  # a square's dirt and the margin's print may stand nearer than the next corner
TOO_NEAR_PX = 1e-3  # to tell a direction
MOST_BEND = np.sin(np.radians(17))  # of an edge from corner to corner: perspective, lens and the ring's own error
EDGE_FRACTION = 0.3  # of a corner's contrast, that its edges must have all along

Links: TypeAlias = NDArray[np.int64]
Cell: TypeAlias = tuple[int, int]


def links(grey: NDArray[np.float32], saddles: Saddles) -> Links:
    """(n, 4) the neighbour along the first edge, against it, along the second, against it; -1 where there is none.

    Seen from the next corner, an edge has dark on its other hand. So it is the first edge of one and the second of the
    other, which rules out that a corner is skipped.
    """
    n = len(saddles.pixels)
    found = np.full((n, 4), -1)
    if n < 2:
        return found
    distance, near = Neighbours(saddles.pixels).nearest(saddles.pixels, min(NEAREST + 1, n))
    distance, near = distance[:, 1:], near[:, 1:]
    towards = np.moveaxis(saddles.pixels[near] - saddles.pixels[:, None], -1, 0) / np.maximum(distance, TOO_NEAR_PX)
    directions = np.stack([np.cos(saddles.edges), np.sin(saddles.edges)])
    for edge in (0, 1):
        here, there = directions[:, :, edge, None], directions[:, near, 1 - edge]
        bend, bend_there = np.abs(_sine(towards, here)), np.abs(_sine(towards, there))
        fits = (bend < MOST_BEND) & (bend_there < MOST_BEND)
        ahead = (towards * here).sum(axis=0) > 0
        cost = distance * (1 + 2 * (bend + bend_there))
        for slot, side in ((2 * edge, ahead), (2 * edge + 1, ~ahead)):
            least = np.where(fits & side, cost, np.inf)
            best = least.argmin(axis=1)
            has = np.isfinite(least[np.arange(n), best])
            found[has, slot] = near[has, best[has]]
    return _mutual_and_sharp(grey, saddles, found)


def grids(saddles: Saddles, links: Links) -> Iterator[Floats]:
    """Each connected grid as (m, n, 2) pixels, NaN where there is no corner."""
    neighbours, ways_on = links.ravel().tolist(), _ways_on(saddles, links).ravel().tolist()
    free = set(np.nonzero((links >= 0).sum(axis=1) >= 2)[0].tolist())
    while free:
        cells = _counted_off(min(free), neighbours, ways_on)
        free -= cells.keys()
        at = np.array(list(cells.values()))
        at -= at.min(axis=0)
        grid = np.full((*(at.max(axis=0) + 1), 2), np.nan)
        grid[at[:, 0], at[:, 1]] = saddles.pixels[list(cells)]
        yield grid


def _counted_off(start: int, neighbours: Sequence[int], ways_on: Sequence[int]) -> dict[int, Cell]:
    """The cell of each corner that can be reached; where two ways disagree, the shorter counts.

    `neighbours` and `ways_on` are (n, 4) and (n, 4, 4), one number after the other.
    """
    cells: dict[int, Cell] = {start: (0, 0)}
    taken: set[Cell] = {(0, 0)}
    queue = deque([(start, 0, 2)])  # and which of its four directions lead one row down, one column on
    while queue:
        corner, down, on = queue.popleft()
        row, column = cells[corner]
        for slot, cell in (
            (down, (row + 1, column)),
            (down ^ 1, (row - 1, column)),
            (on, (row, column + 1)),
            (on ^ 1, (row, column - 1)),
        ):
            link = 4 * corner + slot
            other = neighbours[link]
            if other < 0 or other in cells or cell in taken:
                continue
            cells[other] = cell
            taken.add(cell)
            queue.append((other, ways_on[4 * link + down], ways_on[4 * link + on]))
    return cells


def _ways_on(saddles: Saddles, links: Links) -> Links:
    """(n, 4, 4) for each link, which direction of the next corner, one of its other edge, goes on in each of here."""
    turn = saddles.edges[links][..., ::-1] - saddles.edges[:, None]
    ahead = np.array([2, 0]) + (np.cos(turn) <= 0)
    return np.stack([ahead, ahead ^ 1], axis=-1).reshape(*links.shape, 4)


def _mutual_and_sharp(grey: NDArray[np.float32], saddles: Saddles, found: Links) -> Links:
    """Only the links that both ends want, and that run along an edge from end to end."""
    backs = found[found][:, [[0], [1], [2], [3]], [[2, 3], [2, 3], [0, 1], [0, 1]]]
    corner, slot = np.nonzero((found >= 0) & (backs == np.arange(len(found))[:, None, None]).any(axis=2))
    other = found[corner, slot]
    sharp = _along_edge(grey, saddles, corner, other, slot < 2)
    kept = np.full_like(found, -1)
    kept[corner[sharp], slot[sharp]] = other[sharp]
    return kept


def _along_edge(grey: NDArray[np.float32], saddles: Saddles, start: Links, end: Links, dark_first: Mask) -> Mask:
    way = saddles.pixels[end] - saddles.pixels[start]
    across = 0.18 * np.column_stack([-way[:, 1], way[:, 0]])[:, None]
    between = saddles.pixels[start][:, None] + way[:, None] * np.array([0.3, 0.5, 0.7])[:, None]
    step = sample(grey, between - across) - sample(grey, between + across)
    least = EDGE_FRACTION * np.minimum(saddles.contrast[start], saddles.contrast[end])
    return np.asarray(np.where(dark_first[:, None], step, -step).min(axis=1) > least)


def _sine(one: Floats, other: Floats) -> Floats:
    """Of the angle between unit vectors (2, ...)."""
    return np.asarray(one[0] * other[1] - one[1] * other[0])
