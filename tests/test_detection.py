"""What is kept of a photograph."""

import numpy as np

from opencsp_calib.detection import Detection


def test_views_of_the_whole_board_share_what_says_so():
    first, second = (Detection(np.arange(5), np.zeros((5, 2))) for _ in range(2))
    assert first.ids is second.ids
    assert not first.ids.flags.writeable
    np.testing.assert_array_equal(first.ids, np.arange(5))


def test_ids_in_another_order_or_of_a_part_are_kept_as_they_are():
    for ids in ([1, 0, 2], [1, 2, 3], [0, 1, 3], []):
        np.testing.assert_array_equal(Detection(np.array(ids, dtype=int), np.zeros((len(ids), 2))).ids, ids)
