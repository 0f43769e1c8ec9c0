"""Steps along a bent valley, against a sum of squares whose minimum is known."""

from dataclasses import dataclass

import numpy as np
import pytest

from opencsp_calib.arrays import Matrix, Params
from opencsp_calib.valley import arrived, lowest

FLOOR = 0.5  # residual that stays at the minimum, (1, 1)


@dataclass(frozen=True)
class Rosenbrock:
    """A place in Rosenbrock's valley y = x², and how steep its sides are."""

    at: Params
    steep: float

    @property
    def triangle(self) -> Matrix:
        x, y = self.at
        rows = [[2.0 * self.steep * x, -self.steep, self.steep * (y - x * x)], [1.0, 0.0, 1.0 - x], [0.0, 0.0, FLOOR]]
        return np.linalg.qr(np.array(rows), mode="r")

    @property
    def cost(self) -> float:
        return float((self.triangle[:, -1] ** 2).sum())

    @property
    def promised(self) -> float:
        return float((self.triangle[:-1, -1] ** 2).sum())


@pytest.mark.parametrize("start", [(0.5, 0.25), (1.5, 2.25), (3.0, 9.0)])
def test_the_minimum_of_a_bent_valley_is_found(start):
    end = lowest(Rosenbrock(np.array(start), 10.0), lambda here, step: Rosenbrock(here.at + step, 10.0), 1.0)
    assert arrived(end)
    np.testing.assert_allclose(end.at, [1.0, 1.0], atol=1e-7)


def test_no_higher_place_is_taken_where_no_step_leads_lower():
    start = Rosenbrock(np.array([-1.2, 1.44]), 1e4)
    assert lowest(start, lambda here, step: None, 1.0) is start
    assert lowest(start, lambda here, step: Rosenbrock(here.at + np.array([0.0, 1.0]), 1e4), 1.0) is start
