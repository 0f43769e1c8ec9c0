"""Camera calibration for photogrammetry: boards, photographs, cameras, and how far to trust them."""

from opencsp_calib.board import Board, CharucoBoard, Checkerboard
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Detection, Observations, Problem, RejectedCorner, View
from opencsp_calib.errors import CalibError, CalibrationFailedError, InputError
from opencsp_calib.hookspecs import hookimpl
from opencsp_calib.image import Image
from opencsp_calib.options import SolveOptions
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
    "Image",
    "InputError",
    "Observations",
    "Pose",
    "Problem",
    "RejectedCorner",
    "SolveOptions",
    "View",
    "hookimpl",
]
