"""The model of a corner's image that is fitted: its derivatives."""

import numpy as np
import pytest

from opencsp_calib.arrays import Floats


@pytest.mark.parametrize("second_edge", [0.15 + np.pi / 2, 1.3, -2.2])
def test_derivatives_are_those_of_the_model(second_edge: float) -> None:
    from opencsp_calib.corner_kernel import layout as kernel
    from opencsp_calib.corner_kernel.image_model import differentiate

    grid = np.random.default_rng(1).uniform(-6, 6, (2, 200))
    table = np.zeros((kernel.COLUMNS, kernel.MOST_PIXELS))
    p = np.array([0.2, -0.1, 0.15, second_edge, 1.3, 100.0, 60.0, 0.03, -0.02, 0.01, 0.02])

    def columns(p: Floats) -> Floats:
        table[kernel.X, :200] = grid[0] - p[0]
        table[kernel.Y, :200] = grid[1] - p[1]
        differentiate(p, 0.002, -0.001, np.array([100.0, 100.0, np.inf, np.inf]), 200, table)
        return table[: kernel.RESIDUAL + 1, :200].copy()

    analytic = columns(p)
    for k in range(kernel.PARAMETERS):
        step = np.zeros(kernel.PARAMETERS)
        step[k] = 1e-5
        numeric = -(columns(p + step)[-1] - columns(p - step)[-1]) / 2e-5
        assert np.abs(numeric - analytic[k]).max() < 0.04 * np.abs(analytic[k]).max()
