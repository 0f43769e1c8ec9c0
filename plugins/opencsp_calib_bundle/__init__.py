"""The solver ``bundle``: our own bundle adjustment."""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import Solver


@hookimpl
def solvers() -> Iterator[Solver]:
    """See `opencsp_calib.hookspecs.solvers`."""
    from opencsp_calib_bundle.solver import BundleSolver

    yield BundleSolver()
