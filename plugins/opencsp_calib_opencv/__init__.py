"""OpenCV as a plugin: boards and their detectors, and the solver `calibrateCamera`.

``cv2`` is imported only when something runs. Any package that brings it from 4.9 on serves, with or without windows.
"""

from collections.abc import Iterator

from opencsp_calib import hookimpl
from opencsp_calib.interfaces import Detector

__all__ = ["detectors"]


@hookimpl
def detectors() -> Iterator[Detector]:
    """Plain checkerboards, ChArUco boards, and OpenCSP's own way with the first."""
    from opencsp_calib_opencv.charuco import CharucoDetector
    from opencsp_calib_opencv.checkerboard import CheckerboardDetector
    from opencsp_calib_opencv.opencsp import OpenCSPDetector

    yield CheckerboardDetector()
    yield CharucoDetector()
    yield OpenCSPDetector()
