"""The convex hull of pixels.

SciPy has one, but importing it takes as long as calibrating from a dozen photographs.
"""

import numpy as np

from opencsp_calib.arrays import Floats, Mask, Pixels

__all__ = ["convex_hull", "hull_area", "within_hull"]


def convex_hull(pixels: Pixels) -> Pixels:
    """(h, 2) corners of the hull of (n, 2) pixels, in order; fewer than three where all stand on one line.

    From left to right below and back above, keeping left turns only (Andrew, "Another efficient algorithm for convex
    hulls in two dimensions", 1979).
    """
    ordered = [(float(x), float(y)) for x, y in np.unique(_outer(pixels), axis=0)]
    hull: list[tuple[float, float]] = []
    for way in (ordered, ordered[::-1]):
        first = len(hull)
        for x, y in way:
            while len(hull) - first >= 2 and _turn(hull[-2], hull[-1], (x, y)) <= 0:
                hull.pop()
            hull.append((x, y))
        del hull[-1:]  # it begins the way back
    return np.array(hull, dtype=np.float64).reshape(-1, 2)


def _outer(pixels: Pixels) -> Pixels:
    """Without those within the octagon of the outermost in eight directions: most, seen at once (Akl and Toussaint)."""
    if len(pixels) < 16:
        return pixels
    angles = np.arange(8) * (np.pi / 4)
    farthest = (pixels @ np.stack([np.cos(angles), np.sin(angles)])).argmax(axis=0)
    octagon = pixels[farthest[farthest != np.roll(farthest, -1)]]
    edges: Floats = np.roll(octagon, -1, axis=0) - octagon
    left = edges[:, 0] * (pixels[:, None, 1] - octagon[:, 1]) - edges[:, 1] * (pixels[:, None, 0] - octagon[:, 0])
    return pixels[~(left > 0).all(axis=1)] if len(octagon) >= 3 else pixels


def hull_area(hull: Pixels) -> float:
    """Px² within a hull's corners (h, 2)."""
    x, y = hull.T
    return float(0.5 * (x * np.roll(y, -1) - np.roll(x, -1) * y).sum())


def within_hull(hull: Pixels, pixels: Pixels) -> Mask:
    """(n,) which of the (n, 2) pixels lie within a hull's corners (h, 2), or on its edge; none if it has no area."""
    if len(hull) < 3:
        return np.zeros(len(pixels), dtype=np.bool_)
    edges: Floats = np.roll(hull, -1, axis=0) - hull
    # (n, h): to the left of every edge
    left = edges[:, 0] * (pixels[:, None, 1] - hull[:, 1]) - edges[:, 1] * (pixels[:, None, 0] - hull[:, 0])
    return np.asarray((left >= 0).all(axis=1))


def _turn(a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]) -> float:
    """Positive where the way from a by b to c turns left."""
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
