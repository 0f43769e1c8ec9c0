"""mrcal as a plugin: its solver, run in the Python that has it."""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import Solver

__all__ = ["solvers"]


@hookimpl
def solvers() -> Iterator[Solver]:
    """The solver ``mrcal``."""
    from opencsp_calib_mrcal.solver import MrcalSolver

    yield MrcalSolver()
