"""The solver ``opencv``: ``cv2.calibrateCamera``, and ``cv2.fisheye.calibrate`` for fisheye."""

from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any

import numpy as np

from opencsp_calib import Board, CalibrationFailedError, InputError, Observations, SolveOptions
from opencsp_calib.arrays import Points
from opencsp_calib.calibration import Calibration
from opencsp_calib.convergence import determined
from opencsp_calib.initial import initial_camera
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.opencv import opencv_on_one_thread
from opencsp_calib.solving import check_request, finished
from opencsp_calib_opencv.available import missing_opencv
from opencsp_calib_opencv.finishing import Solution, finish

__all__ = ["OpenCVSolver"]

ITERATIONS = 300
SMALLEST_STEP = 2.3e-16
"""OpenCV stops where a step is smaller than this part of the parameters: at double precision, since the default stops
up to 1e-8 px short. It has no test of the gradient."""


class OpenCVSolver:
    """OpenCV's own calibration, equal weights, flat or measured board held as it is.

    But for fisheye, `cv2.calibrateCamera` takes pixels and board points in single precision only, which rounds pixels
    beyond 1024 by up to 6e-5 px, and it may stop short. So it is left to find the minimum, and the last steps are made
    with OpenCV's own projections and derivatives, which are in double precision; see `finish`.
    """

    name = "opencv"
    models = frozenset(LENS_MODELS)
    abilities = frozenset({"guess", "pixel_aspect"})

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        return missing_opencv()

    def version(self) -> str:
        """See `Solver.version`."""
        import cv2

        return str(cv2.__version__)

    def solve(self, observations: Observations, model: str, options: SolveOptions) -> Calibration:
        """See `Solver.solve`."""
        check_request(self, observations, model, options)
        engine = _solve_fisheye if model == "opencv_fisheye" else _solve_pinhole
        with opencv_on_one_thread():  # with more, OpenCV's sums, and so its results, differ from run to run
            params, rotations, translations = engine(observations, model, options)
        translations = translations * observations.board.spacing_m
        return determined(finished(self, observations, model, options, params, rotations, translations))


def _solve_pinhole(observations: Observations, model: str, options: SolveOptions) -> Solution:
    import cv2

    count = len(LENS_MODELS[model].distortion_names)
    matrix, distortion = np.eye(3), np.zeros(max(count, 5))
    flags = _coefficient_flags(cv2, count)
    if options.pixel_aspect is not None:
        matrix[1, 1] = options.pixel_aspect
        flags |= cv2.CALIB_FIX_ASPECT_RATIO
    if options.guess or observations.board.points[:, 2].any():  # OpenCV finds a start for itself only if all z are 0
        start = initial_camera(observations, model, options.guess, options.pixel_aspect)
        matrix, distortion[:count] = start.matrix, start.distortion
        flags |= cv2.CALIB_USE_INTRINSIC_GUESS
    points, detections = _vendor_points(observations.board), observations.detections
    with _vendor_errors(cv2, observations):
        _, matrix, distortion, rotations, translations = cv2.calibrateCamera(
            [points[d.ids].astype(np.float32) for d in detections],
            [d.pixels.astype(np.float32) for d in detections],
            observations.image_size,
            matrix,
            distortion,
            flags=flags,
            criteria=_criteria(cv2),
        )
        found = _unpacked(matrix, np.ravel(distortion)[:count], rotations, translations)
        return finish(found, points, detections, options.pixel_aspect)


def _solve_fisheye(observations: Observations, model: str, options: SolveOptions) -> Solution:
    import cv2

    if options.pixel_aspect is not None:
        raise InputError("OpenCV cannot hold the pixel aspect of a fisheye; leave it free or take another solver")
    start = initial_camera(observations, model, options.guess)
    flags = cv2.fisheye if hasattr(cv2.fisheye, "CALIB_FIX_SKEW") else cv2  # OpenCV 5 has moved them
    points, detections = _vendor_points(observations.board), observations.detections
    with _vendor_errors(cv2, observations):
        _, matrix, distortion, rotations, translations = cv2.fisheye.calibrate(
            [points[d.ids][None] for d in detections],  # one row each: OpenCV 5 fails on columns
            [d.pixels[None] for d in detections],
            observations.image_size,
            start.matrix,
            start.distortion.copy(),
            # without new extrinsics at each step OpenCV's iteration wanders off even from exact data
            flags=flags.CALIB_FIX_SKEW | flags.CALIB_RECOMPUTE_EXTRINSIC | flags.CALIB_USE_INTRINSIC_GUESS,
            criteria=_criteria(cv2),
        )
    return _unpacked(matrix, np.ravel(distortion), rotations, translations)


def _coefficient_flags(cv2: ModuleType, count: int) -> int:
    """What makes OpenCV solve for the first `count` of its coefficients and no others."""
    flags = {
        0: cv2.CALIB_ZERO_TANGENT_DIST | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2 | cv2.CALIB_FIX_K3,
        4: cv2.CALIB_FIX_K3,
        5: 0,
        8: cv2.CALIB_RATIONAL_MODEL,
        12: cv2.CALIB_RATIONAL_MODEL | cv2.CALIB_THIN_PRISM_MODEL,
        14: cv2.CALIB_RATIONAL_MODEL | cv2.CALIB_THIN_PRISM_MODEL | cv2.CALIB_TILTED_MODEL,
    }
    return int(flags[count])


def _criteria(cv2: ModuleType) -> tuple[int, int, float]:
    return cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, ITERATIONS, SMALLEST_STEP


def _vendor_points(board: Board) -> Points:
    """(K, 3) the board's in units of the spacing, where even ones are exact in single precision."""
    return board.points / board.spacing_m


def _unpacked(matrix: Any, distortion: Any, rotations: Any, translations: Any) -> Solution:
    params = np.concatenate([[matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]], distortion])
    return Solution(params, np.reshape(rotations, (-1, 3)), np.reshape(translations, (-1, 3)))


@contextmanager
def _vendor_errors(cv2: ModuleType, observations: Observations) -> Iterator[None]:
    """OpenCV's errors as ours: its own are several lines long and tell of its source files."""
    try:
        yield
    except cv2.error as error:
        said = " ".join(str(error.err).split())
        message = f"OpenCV found no solution from {len(observations.used)} views: {said}"
        raise CalibrationFailedError(message) from error
