"""The next place of an iteration that converges slowly, from all places before: Anderson's extrapolation.

Near a minimum every step is a linear function of the place, plus a little. So the places visited are combined such that
the same combination of their steps is as short as can be, which is where the step vanishes but for what the places
have not explored. Few directions being slow, few places are enough. Source: D. Anderson, "Iterative procedures for
nonlinear integral equations", 1965; H. Walker and P. Ni, "Anderson acceleration for fixed-point iterations", 2011.
"""

from collections.abc import Sequence

import numpy as np

from opencsp_calib.arrays import Floats, Matrix

__all__ = ["extrapolated"]


def extrapolated(places: Sequence[Floats], steps: Sequence[Floats], covariance: Matrix) -> Floats:
    """(n,) the next place.

    Parameters
    ----------
    places, steps : sequences of (n,)
        Where the iteration has been, and the step it would take from there; at least one of each.
    covariance : (M, M)
        Of the first M unknowns, which are the slow ones: a step's length is measured in their sigmas.
    """
    place, step = places[-1], steps[-1]
    if len(steps) < 2:
        return place + step
    whitened = np.linalg.solve(np.linalg.cholesky(covariance), np.array(steps)[:, : len(covariance)].T)
    by = np.linalg.lstsq(np.diff(whitened), whitened[:, -1], rcond=None)[0]
    return np.asarray(place + step - by @ (np.diff(places, axis=0) + np.diff(steps, axis=0)))
