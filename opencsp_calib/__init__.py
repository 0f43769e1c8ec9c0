"""Camera calibration for photogrammetry: boards, photographs, cameras, and how far to trust them.

The same as on the command line, in five lines::

    from opencsp_calib import Camera, Checkerboard, calibrate, compare, detect, solve
    board = Checkerboard(columns=18, rows=23, spacing_m=0.05)
    observations = detect("photographs/*.png", board)
    calibration = solve(observations, model="opencv4")
    calibration.camera.save("camera.h5")
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from opencsp_calib.board import Board, CharucoBoard, Checkerboard
    from opencsp_calib.calibration import Calibration
    from opencsp_calib.camera import Camera
    from opencsp_calib.comparison import Difference, compare
    from opencsp_calib.detection import Detection, Observations, Problem, RejectedCorner, View
    from opencsp_calib.errors import CalibError, CalibrationFailedError, InputError
    from opencsp_calib.hdf5_calibration import load_calibration, save_calibration
    from opencsp_calib.hookspecs import hookimpl
    from opencsp_calib.image import Image
    from opencsp_calib.options import SolveOptions
    from opencsp_calib.pipeline import calibrate, detect, solve
    from opencsp_calib.pose import Pose

__all__ = [
    "Board",
    "CalibError",
    "Calibration",
    "CalibrationFailedError",
    "Camera",
    "CharucoBoard",
    "Checkerboard",
    "Detection",
    "Difference",
    "Image",
    "InputError",
    "Observations",
    "Pose",
    "Problem",
    "RejectedCorner",
    "SolveOptions",
    "View",
    "calibrate",
    "compare",
    "detect",
    "hookimpl",
    "load_calibration",
    "save_calibration",
    "solve",
]

_HOME = {
    "Board": "board",
    "CalibError": "errors",
    "Calibration": "calibration",
    "CalibrationFailedError": "errors",
    "Camera": "camera",
    "CharucoBoard": "board",
    "Checkerboard": "board",
    "Detection": "detection",
    "Difference": "comparison",
    "Image": "image",
    "InputError": "errors",
    "Observations": "detection",
    "Pose": "pose",
    "Problem": "detection",
    "RejectedCorner": "detection",
    "SolveOptions": "options",
    "View": "detection",
    "calibrate": "pipeline",
    "compare": "comparison",
    "detect": "pipeline",
    "hookimpl": "hookspecs",
    "load_calibration": "hdf5_calibration",
    "save_calibration": "hdf5_calibration",
    "solve": "pipeline",
}


def __getattr__(name: str) -> Any:
    """Load what is asked for when it is asked for, so that starting stays quick."""
    if name not in _HOME:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME[name]}"), name)


def __dir__() -> list[str]:
    return __all__
