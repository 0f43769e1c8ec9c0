"""All solvers end at one minimum also where observations barely determine the lens model's coefficients."""

import numpy as np
import pytest
from solver_worlds import sandia, seed_world

from opencsp_calib.comparison import pixel_grid
from opencsp_calib.convergence import remaining_sigmas
from opencsp_calib.options import SolveOptions
from opencsp_calib.registry import installed

SOLVERS = {name: solver for name, solver in installed().solvers.items() if solver.missing() is None}


@pytest.mark.parametrize("model", ["opencv8", "opencv12"])
def test_a_lens_that_has_no_use_for_a_fraction(model):
    """Numerator and denominator can be traded for one another along a bent valley of nearly equal sums of squares."""
    camera, _, observations = seed_world(15, noise_px=0.01)
    rays = camera.unproject(pixel_grid(camera.image_size, (9, 7)).reshape(-1, 2))
    seen = []
    for solver in (solver for solver in SOLVERS.values() if model in solver.models):
        calibration = solver.solve(observations, model, SolveOptions())
        assert not calibration.problems
        assert remaining_sigmas(calibration) < 1e-3
        seen.append(calibration.camera.project(rays))
    assert len(seen) >= 2
    assert np.ptp(seen, axis=0).max() < 1e-5


def test_bundle_is_at_the_minimum_where_digits_of_the_sum_of_squares_cannot_tell(data_dir):
    observations, _ = sandia(data_dir)
    assert remaining_sigmas(SOLVERS["bundle"].solve(observations, "opencv8", SolveOptions())) < 1e-5
