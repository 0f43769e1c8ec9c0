"""OpenCV as a plugin: boards and their detectors, and the solver `calibrateCamera`.

``cv2`` is imported only when something runs. Any package that brings it from 4.9 on serves, with or without windows.
"""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import BoardKind, Detector, Solver

__all__ = ["boards", "detectors", "solvers"]


@hookimpl
def boards() -> Iterator[BoardKind]:
    """Plain checkerboards and ChArUco boards."""
    from opencsp_calib_opencv.board_kinds import CharucoKind, CheckerboardKind

    yield CheckerboardKind()
    yield CharucoKind()


@hookimpl
def detectors() -> Iterator[Detector]:
    """Plain checkerboards, ChArUco boards, and OpenCSP's own way with the first."""
    from opencsp_calib_opencv.charuco import CharucoDetector
    from opencsp_calib_opencv.checkerboard import CheckerboardDetector
    from opencsp_calib_opencv.opencsp import OpenCSPDetector

    yield CheckerboardDetector()
    yield CharucoDetector()
    yield OpenCSPDetector()


@hookimpl
def solvers() -> Iterator[Solver]:
    """`calibrateCamera` and `fisheye.calibrate`."""
    from opencsp_calib_opencv.solver import OpenCVSolver

    yield OpenCVSolver()
