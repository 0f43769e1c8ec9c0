"""COLMAP as a plugin: its bundle adjuster as a solver."""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import Solver

__all__ = ["solvers"]


@hookimpl
def solvers() -> Iterator[Solver]:
    """The solver ``colmap``."""
    from opencsp_calib_colmap.solver import ColmapSolver

    yield ColmapSolver()
