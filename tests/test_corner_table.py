"""The table of all corners: their weights, and some of them alone."""

import numpy as np

from opencsp_calib.corner_table import CornerTable
from opencsp_calib.detection import Detection
from opencsp_calib.normal_equations import solvable_corners


def test_whitening_inverts_the_covariance_and_fills_in_the_typical_one():
    covariance = np.array([[[4.0, 1.0], [1.0, 2.0]], [[0.0, 0.0], [0.0, 0.0]], [[9.0, 0.0], [0.0, 3.0]]])
    known = Detection(np.arange(3), np.zeros((3, 2)), covariance)
    unknown = Detection(np.arange(2), np.zeros((2, 2)))
    table = CornerTable.of((known, unknown), "covariance")
    whitening = table.whitening(0, 2).transpose(2, 0, 1)
    information = whitening.transpose(0, 2, 1) @ whitening
    np.testing.assert_allclose(information[[0, 2]], np.linalg.inv(covariance[[0, 2]]), atol=1e-12)
    np.testing.assert_allclose(information[[1, 3, 4]], np.tile(np.eye(2) / 3.5, (3, 1, 1)), atol=1e-12)
    assert CornerTable.of((unknown,), "covariance").typical_weight == 1.0
    assert CornerTable.of((known,), "equal").whitening(0, 1) is None


def test_table_keeps_corners_with_their_views():
    views = [Detection(np.arange(n), np.full((n, 2), n)) for n in (5, 0, 3, 4000, 4000)]
    table = CornerTable.of(views)
    assert list(table.chunks()) == [(0, 4), (4, 5)]
    kept = table.keeping(table.ids != 1)
    np.testing.assert_array_equal(kept.counts, [4, 0, 2, 3999, 3999])
    np.testing.assert_array_equal(kept.pixels[:, 0], np.array([5, 0, 3, 4000, 4000])[kept.view])
    assert [len(part) for part in table.split(table.ids == 1)] == [5, 0, 3, 4000, 4000]
    np.testing.assert_array_equal(solvable_corners(table, 4001)[[0, -1]], [0, 3999])


def test_a_thinned_table_has_some_corners_of_every_view():
    table = CornerTable.of([Detection(np.arange(n), np.full((n, 2), n)) for n in (5, 0, 60, 4000)])
    thinned = table.thinned(1000)
    np.testing.assert_array_equal(thinned.counts[:3], [5, 0, 40])
    assert 900 < thinned.counts[3] < 1100
    assert set(thinned.pixels[thinned.view == 3, 0]) == {4000}
    np.testing.assert_array_equal(table.thinned(1000).ids, thinned.ids)
    assert table.thinned(5000) is table
