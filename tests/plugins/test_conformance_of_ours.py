"""Our own plugins keep the promises that the conformance kit asks of everybody's."""

from opencsp_calib.conformance import parametrize_checks
from opencsp_calib_bundle.solver import BundleSolver
from opencsp_calib_colmap.solver import ColmapSolver
from opencsp_calib_mrcal.solver import MrcalSolver
from opencsp_calib_opencv.solver import OpenCVSolver


@parametrize_checks(OpenCVSolver(), MrcalSolver(), ColmapSolver(), BundleSolver())
def test_solver(provided, check):
    check(provided)
