"""The convex hull, against SciPy's."""

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from opencsp_calib.convex_hull import convex_hull, hull_area, within_hull


@pytest.mark.parametrize("seed", range(5))
def test_it_is_scipys(seed: int) -> None:
    rng = np.random.default_rng(seed)
    pixels, others = rng.normal(800, 100, (2, 400, 2))
    theirs, hull = ConvexHull(pixels), convex_hull(pixels)
    assert {tuple(p) for p in hull} == {tuple(p) for p in pixels[theirs.vertices]}
    assert hull_area(hull) == pytest.approx(theirs.volume, rel=1e-12)
    inside = (others @ theirs.equations[:, :2].T + theirs.equations[:, 2] <= 0).all(axis=1)
    assert np.array_equal(within_hull(hull, others), inside)


def test_of_a_grid_only_the_corners_are_left() -> None:
    pixels = np.mgrid[0:5, 0:4].reshape(2, -1).T
    hull = convex_hull(pixels)
    assert sorted(map(tuple, hull)) == [(0, 0), (0, 3), (4, 0), (4, 3)]
    assert hull_area(hull) == 12
    assert within_hull(hull, pixels).all()


@pytest.mark.parametrize("pixels", [np.empty((0, 2)), [[3.0, 4.0]], [[0, 0], [1, 2], [2, 4]], [[1, 1]] * 5])
def test_what_has_no_area_holds_nothing(pixels) -> None:
    hull = convex_hull(np.asarray(pixels, dtype=float))
    assert len(hull) < 3
    assert hull_area(hull) == 0
    assert not within_hull(hull, np.zeros((2, 2))).any()
