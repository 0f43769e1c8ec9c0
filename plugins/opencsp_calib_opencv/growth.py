"""A grid made whole: corners that do not belong are taken out, those that were overlooked are put in."""

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats, Mask, Pixels
from opencsp_calib_opencv.grid import (
    count,
    height_between,
    known,
    mean_known,
    padded,
    predicted,
    square_height,
    steps,
    trimmed,
)
from opencsp_calib_opencv.neighbours import Neighbours
from opencsp_calib_opencv.rings import Rings, look

__all__ = ["belongs", "filled", "grown", "pruned"]

MOST_MISFIT = 0.3  # of the squares' height; perspective itself bends by a tenth, a wrong corner is off by half
REACH = 0.35  # of the squares' height: how far from its predicted place an overlooked corner is looked for
RING = 0.3  # of the squares' height: clear of the blur of the next edge
SMALLEST_RING_PX, LARGEST_RING_PX = 1.8, 10.0
MOST_UNLIKENESS = 0.3  # looser than without a grid: here place, directions and colours must agree as well; but not
USUAL_UNLIKENESS = 0.1, 3.0  # more than this, and so many times what is usual in this grid: noise is the same for all
CONTRAST_FRACTION = 0.15  # of the grid's median: a shadow takes five sixths
MOST_TURN_RAD = np.radians(20)
MOST_ROUNDS = 100


def pruned(grey: NDArray[np.float32], grid: Floats) -> Floats:
    """Without the corners that stand off the lines of their neighbours, or do not look like a corner of this grid."""
    for _ in range(MOST_ROUNDS):
        misfit = np.linalg.norm(grid - predicted(grid), axis=-1) / square_height(grid)
        aligned = (np.nan_to_num(misfit) < MOST_MISFIT).all(axis=0) & ~np.isnan(misfit).all(axis=0)
        keep = aligned & belongs(grey, grid)
        if (keep == known(grid)).all():
            break
        grid = trimmed(np.where(keep[..., None], grid, np.nan))
    return grid


def grown(grey: NDArray[np.float32], grid: Floats, saddles: Pixels, longest: int) -> Floats:
    """With every saddle put in that stands where a corner is missing, inside or beside the grid, and looks like one.

    Where that comes to an end, one line of corners is passed over: a cable or a finger may hide it. A grid of more than
    `longest` rows or columns is none that is looked for, and grows no further: a tiled floor would take seconds.
    """
    tree = Neighbours(saddles)
    for _ in range(MOST_ROUNDS):
        size = count(grid)
        if max(grid.shape[:2]) > longest:
            break
        for distance in (1, 2):
            grid = trimmed(_joined(grey, padded(grid, distance), tree, distance, RING))
            if count(grid) > size:
                break
        else:
            break
    return grid


def filled(grey: NDArray[np.float32], grid: Floats, saddles: Pixels, ring: float) -> Floats:
    """With every saddle put in that stands where a corner of the grid is missing, and looks like one.

    `ring` is the radius, as a part of the squares' height, within which nothing but the checkerboard is printed.
    """
    tree = Neighbours(saddles)
    for _ in range(MOST_ROUNDS):
        fuller = _joined(grey, grid, tree, 1, ring)
        if count(fuller) == count(grid):
            break
        grid = fuller
    return grid


def _joined(grey: NDArray[np.float32], grid: Floats, saddles: Neighbours, distance: int, ring: float) -> Floats:
    """With the saddles that stand where a corner should be, up to so many steps from the known ones."""
    foretold = grid
    for _ in range(distance):
        foretold = np.where(known(foretold)[..., None], foretold, mean_known(*predicted(foretold)))
    empty = ~known(grid) & known(foretold)
    off, nearest = (found[:, 0] for found in saddles.nearest(foretold[empty]))
    height = np.nan_to_num(square_height(foretold)[empty])
    hit = off < REACH * height
    hit[hit] = _corner_like(look(grey, saddles.pixels[nearest[hit]], _radii(ring * height[hit])), MOST_UNLIKENESS)
    if not hit.any():
        return grid
    tried = np.zeros_like(empty)
    tried[empty] = hit
    fuller = grid.copy()
    fuller[tried] = saddles.pixels[nearest[hit]]
    fuller[tried & ~belongs(grey, fuller, ring)] = np.nan
    return np.asarray(fuller)


def belongs(grey: NDArray[np.float32], grid: Floats, ring: float = RING) -> Mask:
    """(m, n) whether there is a corner and it looks like one of this grid, by its edges' directions and its colours."""
    there = known(grid)
    if not there.any():
        return there
    down, on = (step[there] for step in steps(grid))
    rings = look(grey, grid[there], _radii(np.nan_to_num(ring * height_between(down, on))))
    row, column = np.nonzero(there)
    swapped = (row + column) % 2 == 1  # the first edge of one corner is the second of the next
    edges = np.where(swapped[:, None], rings.edges[:, ::-1], rings.edges)
    angles = np.column_stack([np.arctan2(step[:, 1], step[:, 0]) for step in (down, on)])
    straight = _turn(edges, angles) < MOST_TURN_RAD
    crossed = _turn(edges, angles[:, ::-1]) < MOST_TURN_RAD
    usual = USUAL_UNLIKENESS[0] + USUAL_UNLIKENESS[1] * float(np.median(rings.unlikeness))
    good = _corner_like(rings, min(MOST_UNLIKENESS, usual))
    good &= rings.contrast > CONTRAST_FRACTION * np.median(rings.contrast)
    there[there] = good & (straight if straight.sum() >= crossed.sum() else crossed)
    return there


def _radii(wanted: Floats) -> Floats:
    return np.clip(wanted, SMALLEST_RING_PX, LARGEST_RING_PX)


def _corner_like(rings: Rings, most_unlikeness: float) -> Mask:
    return np.asarray(rings.crossing & (rings.unlikeness < most_unlikeness))


def _turn(edges: Floats, angles: Floats) -> Floats:
    """(n,) rad, the larger of the angles between two pairs of lines."""
    return np.asarray(np.abs((edges - angles + np.pi / 2) % np.pi - np.pi / 2).max(axis=1))
