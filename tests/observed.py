"""Two sets of observations compared to the last bit."""

from dataclasses import fields

import numpy as np

from opencsp_calib import Observations


def assert_same(found: Observations, expected: Observations) -> None:
    """The same views, with the same of everything in them."""
    assert (found.board, found.image_size, len(found.views)) == (
        expected.board,
        expected.image_size,
        len(expected.views),
    )
    for one, other in zip(found.views, expected.views, strict=True):
        assert (one.image, one.status, one.problems, one.sha256) == (
            other.image,
            other.status,
            other.problems,
            other.sha256,
        )
        for field in fields(one.detection):
            here, there = getattr(one.detection, field.name), getattr(other.detection, field.name)
            if isinstance(there, np.ndarray):
                np.testing.assert_array_equal(here, there, strict=True)
            else:
                assert here == there
