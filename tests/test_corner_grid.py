"""What a corner's neighbours tell: how edges run and bend, and which corners are not where they should be."""

import numpy as np
import pytest
from corner_views import view

from opencsp_calib.corner_grid import bends, displaced, edges


def test_bends_are_those_of_circles() -> None:
    radius = 900.0
    row, column = np.divmod(np.arange(88), 11)
    angle = (column - 5) * 30 / radius
    r = radius + 30 * row
    pixels = np.column_stack([r * np.sin(angle), r * np.cos(angle)]) + np.random.default_rng(0).normal(
        0, 0.004, (88, 2)
    )
    values, deviations = bends(pixels, np.arange(88), 11)
    # an edge along a row turns from x towards minus y: against the quarter turn from x to y
    assert values[:, 0] == pytest.approx(-1 / r, rel=0.05)
    assert values[:, 1] == pytest.approx(0, abs=3e-5)
    assert deviations.max() < 3e-5


def test_edges_come_from_neighbours_or_from_the_nearest_that_has_some() -> None:
    row, column = np.divmod(np.arange(88), 11)
    pixels = np.column_stack([20.0 * column, 15.0 * row])
    chosen = np.isin(np.arange(88), [0, 1, 11, 50])
    vectors, lengths = edges(pixels[chosen], np.flatnonzero(chosen), 11)
    assert np.allclose(vectors, [[20, 0], [0, 15]])
    assert np.allclose(lengths, [20, 15])


def test_a_corner_alone_in_its_row_takes_the_edge_of_the_nearest_on_the_board() -> None:
    row, column = np.divmod(np.arange(88), 11)
    pixels = np.column_stack([20.0 * column + 0.3 * column**2, 15.0 * row])  # squares grow from left to right
    chosen = (row > 0) | (column == 8)
    ids = np.flatnonzero(chosen)
    vectors, lengths = edges(pixels[chosen], ids, 11)
    alone, below = np.searchsorted(ids, [8, 19])
    assert np.array_equal(vectors[alone, 0], vectors[below, 0])
    assert lengths[alone, 0] == lengths[below, 0]
    assert not np.allclose(vectors[alone, 0], vectors[ids == 11, 0])


def test_thirty_corners_with_two_neighbours_tell_a_bend_that_changes_as_a_cubic() -> None:
    row, column = np.divmod(np.arange(42), 7)
    across = 1e-3 * (column - 3.0) ** 5  # whose second differences are a cubic
    values, _ = bends(np.column_stack([100.0 * column, 100.0 * row + across]), np.arange(42), 7)
    assert values[:, 0] == pytest.approx(1e-7 * (20 * (column - 3.0) ** 3 + 10 * (column - 3.0)), abs=1e-9)


def test_displaced_corners_are_told_by_their_neighbours() -> None:
    seen = view(22, 50, focal_px=330.0, k1=-0.2)
    noise = np.random.default_rng(0).normal(0, 0.01, (88, 2))
    assert not displaced(seen.truth + noise, np.arange(88), 11).any()
    off = seen.truth + noise
    off[[16, 60]] += [[0.9, 0.8], [-1.5, 0.2]]
    assert np.array_equal(np.flatnonzero(displaced(off, np.arange(88), 11)), [16, 60])
