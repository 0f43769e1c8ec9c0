"""Cholesky factors by blocks of NumPy's products: as fast as LAPACK's on one core, and solved with by NumPy alone.

SciPy would do it in one call, but it brings a BLAS library of its own, whose threads compete with those of NumPy's
for the same cores: between products by NumPy that made a factor of 308 unknowns a hundred times slower.
"""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats, Matrix

__all__ = ["CholeskyRoot"]

BLOCK = 64


@dataclass(frozen=True, eq=False)
class CholeskyRoot:
    """The lower triangular L with L Lᵀ a positive definite matrix.

    Parameters
    ----------
    lower : (n, n)
        Above its diagonal blocks is whatever was there.
    inverses : tuple of (b, b)
        Of its diagonal blocks, from the first down.
    """

    lower: Matrix
    inverses: tuple[Matrix, ...]

    @classmethod
    def of(cls, matrix: Matrix) -> "CholeskyRoot":
        """The root of a positive definite matrix (n, n), left in its place: it may be the largest thing in memory.

        Nothing but the lower triangle is read, and nothing beyond its diagonal blocks written to: what nobody has
        touched may not even be in memory.

        Raises
        ------
        numpy.linalg.LinAlgError
            If it is not, to working precision.
        """
        inverses = []
        for first in range(0, len(matrix), BLOCK):
            end = min(first + BLOCK, len(matrix))
            left = matrix[first:, first:end] - matrix[first:, :first] @ matrix[first:end, :first].T
            root = np.linalg.cholesky(left[: end - first])
            inverses.append(np.asarray(np.linalg.inv(root), dtype=np.float64))
            matrix[first:end, first:end] = root
            matrix[end:, first:end] = left[end - first :] @ inverses[-1].T
        return cls(matrix, tuple(inverses))

    def solve(self, right: Floats) -> Floats:
        """Solutions x of ``L Lᵀ x = right``, (n, R)."""
        return self.solve_upper(self.solve_lower(right))

    def solve_lower(self, right: Floats) -> Floats:
        """Solutions x of ``L x = right``, (n, R)."""
        x: Floats = right.copy()
        for index, inverse in enumerate(self.inverses):
            rows = slice(index * BLOCK, index * BLOCK + len(inverse))
            x[rows] = inverse @ (x[rows] - self.lower[rows, : rows.start] @ x[: rows.start])
        return x

    def solve_upper(self, right: Floats) -> Floats:
        """Solutions x of ``Lᵀ x = right``, (n, R)."""
        x: Floats = right.copy()
        for index, inverse in reversed(tuple(enumerate(self.inverses))):
            rows = slice(index * BLOCK, index * BLOCK + len(inverse))
            x[rows] = inverse.T @ (x[rows] - self.lower[rows.stop :, rows].T @ x[rows.stop :])
        return x
