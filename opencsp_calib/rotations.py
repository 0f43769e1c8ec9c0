"""Rotation vectors to matrices and back, many at once.

SciPy has both, but importing it takes as long as calibrating from a dozen photographs; everything that has a pose
needs these two.
"""

import numpy as np

from opencsp_calib.arrays import Floats

__all__ = ["rotation_matrices", "rotation_vectors"]

SMALL_RAD = 1e-3  # below, series to the fourth power are exact to rounding


def rotation_matrices(vectors: Floats) -> Floats:
    """(..., 3, 3) matrices of (..., 3) rad rotation vectors: axis times angle (Rodrigues' formula)."""
    x, y, z = np.moveaxis(vectors, -1, 0)
    angle = np.sqrt(x * x + y * y + z * z)
    square, safe = angle * angle, np.where(angle < SMALL_RAD, 1.0, angle)
    sine = np.where(angle < SMALL_RAD, 1.0 - square / 6.0 + square * square / 120.0, np.sin(safe) / safe)
    # half the angle keeps what 1 - cos would cancel
    versine = np.where(
        angle < SMALL_RAD, 0.5 - square / 24.0 + square * square / 720.0, 2.0 * (np.sin(safe / 2.0) / safe) ** 2
    )
    matrices = np.empty((*np.shape(x), 3, 3))
    matrices[..., 0, 0] = 1.0 - versine * (y * y + z * z)
    matrices[..., 1, 1] = 1.0 - versine * (z * z + x * x)
    matrices[..., 2, 2] = 1.0 - versine * (x * x + y * y)
    matrices[..., 0, 1], matrices[..., 1, 0] = versine * x * y - sine * z, versine * x * y + sine * z
    matrices[..., 1, 2], matrices[..., 2, 1] = versine * y * z - sine * x, versine * y * z + sine * x
    matrices[..., 2, 0], matrices[..., 0, 2] = versine * z * x - sine * y, versine * z * x + sine * y
    return matrices


def rotation_vectors(matrices: Floats) -> Floats:
    """(..., 3) rad rotation vectors of (..., 3, 3) matrices, at most half a turn long.

    By way of the quaternion whose largest component is taken first, so that nothing cancels (Markley, "Unit quaternion
    from rotation matrix", 2008). Of a matrix that is a rotation but for rounding, the nearest rotation's.

    Raises
    ------
    ValueError
        If a matrix turns the frame inside out: it is no rotation, nor near one.
    """
    r = np.asarray(matrices, dtype=np.float64)
    if (np.linalg.det(r) <= 0).any():
        raise ValueError("a matrix without a positive determinant is no rotation")
    d = np.stack([r[..., 0, 0], r[..., 1, 1], r[..., 2, 2]], axis=-1)
    trace = d.sum(axis=-1)
    minus = np.stack([r[..., 2, 1] - r[..., 1, 2], r[..., 0, 2] - r[..., 2, 0], r[..., 1, 0] - r[..., 0, 1]], axis=-1)
    # 4 q qᵀ for the quaternion q = (x, y, z, w): its row of the largest diagonal element is q but for its length
    products = np.empty((*trace.shape, 4, 4))
    products[..., :3, :3] = r + np.swapaxes(r, -1, -2)
    for axis in range(3):
        products[..., axis, axis] = 1.0 - trace + 2.0 * d[..., axis]
    products[..., 3, 3] = 1.0 + trace
    products[..., :3, 3] = products[..., 3, :3] = minus
    largest = np.diagonal(products, axis1=-2, axis2=-1).argmax(axis=-1)
    q = np.take_along_axis(products, largest[..., None, None], axis=-2)[..., 0, :]
    q = q / np.linalg.norm(q, axis=-1, keepdims=True)
    q = np.where(q[..., 3:] < 0, -q, q)
    sine = np.linalg.norm(q[..., :3], axis=-1)  # of half the angle
    small = sine < SMALL_RAD
    factor = np.where(small, 2.0 + sine**2 / 3.0, 2.0 * np.arctan2(sine, q[..., 3]) / np.where(small, 1.0, sine))
    return np.asarray(factor[..., None] * q[..., :3])
