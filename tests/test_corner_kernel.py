"""The model of a corner's image that is fitted: its derivatives."""

from ctypes import c_int64

import numpy as np
import pytest

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel import PARAMETERS
from opencsp_calib.native import array_of, native_function, result_of


@pytest.mark.parametrize("second_edge", [0.15 + np.pi / 2, 1.3, -2.2])
def test_derivatives_are_those_of_the_model(second_edge: float) -> None:
    line = array_of(np.float64, 1)
    corner_image = native_function("corner_image", line, line, line, c_int64, line, line, result_of(np.float64, 2))
    grid = np.random.default_rng(1).uniform(-6, 6, (2, 200))
    p = np.array([0.2, -0.1, 0.15, second_edge, 1.3, 100.0, 60.0, 0.03, -0.02, 0.01, 0.02])

    def columns(p: Floats) -> Floats:
        made = np.empty((PARAMETERS + 1, 200))
        window = np.array([100.0, 100.0, np.inf, np.inf])
        corner_image(p, np.array([0.002, -0.001]), window, 200, grid[0] - p[0], grid[1] - p[1], made)
        return made

    analytic = columns(p)
    for k in range(PARAMETERS):
        step = np.zeros(PARAMETERS)
        step[k] = 4e-3  # far enough for single precision, near enough for the model to be straight
        numeric = -(columns(p + step)[-1] - columns(p - step)[-1]) / 8e-3
        assert np.abs(numeric - analytic[k]).max() < 0.04 * np.abs(analytic[k]).max()
