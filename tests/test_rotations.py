"""Rotation vectors and matrices, against SciPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from opencsp_calib.rotations import rotation_matrices, rotation_vectors

AXES = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: np.linalg.norm(axis) > 1e-3)
ANGLES = st.one_of(st.just(0.0), st.just(np.pi), st.floats(1e-12, np.pi), st.floats(np.pi - 1e-6, np.pi))


@given(AXES, ANGLES)
def test_matrices_and_vectors_are_scipys(axis: tuple[float, ...], angle: float) -> None:
    vector = angle * np.array(axis) / np.linalg.norm(axis)
    matrix = Rotation.from_rotvec(vector).as_matrix()
    assert np.allclose(rotation_matrices(vector), matrix, atol=4e-15, rtol=0)
    assert np.allclose(rotation_matrices(rotation_vectors(matrix)), matrix, atol=4e-15, rtol=0)
    if angle < np.pi - 1e-6:  # half a turn either way is the same
        assert np.allclose(rotation_vectors(matrix), vector, atol=2e-15, rtol=1e-14)


def test_many_at_once_are_as_one_by_one() -> None:
    vectors = np.random.default_rng(0).normal(0, 2, (4, 5, 3))
    matrices = rotation_matrices(vectors)
    assert np.array_equal(matrices[2, 3], rotation_matrices(vectors[2, 3]))
    assert np.allclose(rotation_matrices(rotation_vectors(matrices)), matrices, atol=1e-14, rtol=0)
    assert rotation_vectors(np.empty((0, 3, 3))).shape == (0, 3)


def test_what_turns_the_frame_inside_out_is_no_rotation() -> None:
    with pytest.raises(ValueError, match="no rotation"):
        rotation_vectors(np.diag([1.0, 1.0, -1.0]))
