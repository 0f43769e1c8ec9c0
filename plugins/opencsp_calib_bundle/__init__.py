"""Our own bundle adjustment as a plugin: the solver ``bundle``."""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import Solver

__all__ = ["solvers"]


@hookimpl
def solvers() -> Iterator[Solver]:
    """The solver ``bundle``."""
    from opencsp_calib_bundle.solver import BundleSolver

    yield BundleSolver()
