"""The solver ``opencv``: ``cv2.calibrateCamera``, and ``cv2.fisheye.calibrate`` for fisheye."""

from collections.abc import Iterator
from contextlib import contextmanager
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np

from opencsp_calib import CalibrationFailedError, InputError, Observations, SolveOptions
from opencsp_calib.arrays import Floats, Params
from opencsp_calib.calibration import Calibration
from opencsp_calib.convergence import judged
from opencsp_calib.initial import initial_camera
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.opencv import opencv_on_one_thread
from opencsp_calib.rotations import rotation_matrices, rotation_vectors
from opencsp_calib.solving import check_request, finished
from opencsp_calib_opencv.available import missing_opencv

__all__ = ["OpenCVSolver"]

ITERATIONS = 300
SMALLEST_STEP = 2.3e-16
"""OpenCV stops where a step is smaller than this part of the parameters: at double precision, since the default stops
up to 1e-8 px short. It has no test of the gradient."""

TILTED = 14  # coefficients: OpenCV 5 stops anywhere in their valley, so that two answers tell nothing of rounding
RATIONAL, RESTARTS = 8, 3
"""From so many coefficients on OpenCV stops short in the long valleys that those leave; from where it stopped it gets
farther. A few starts are enough."""
MAGNIFIED = 64.0  # times: what rounding moves, so that a new rounding is small beside it, and the curvature still too

Solution: TypeAlias = tuple[Params, Floats, Floats]  # of the lens model; rotations and translations (V, 3)


class OpenCVSolver:
    """OpenCV's own calibration, equal weights, flat or measured board held as it is.

    OpenCV takes pixels and, but for fisheye, board points in single precision only. Board points are given in units
    of the spacing, where those of an even board are exact; those of a measured one are rounded by at most 1e-6 of the
    spacing. Pixels beyond 1024 are rounded by up to 6e-5 px; what that does is found by asking OpenCV a second time,
    with pixels moved so far that their rounding does not matter, and taken back.
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
            solution = engine(observations, model, options)
        return judged(finished(self, observations, model, options, *solution))


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
    points, pixels = _vendor_points(observations, np.float32)

    def least(pixels: list[Any], matrix: Any, distortion: Any, flags: int) -> tuple[Any, ...]:
        return cv2.calibrateCamera(
            points, pixels, observations.image_size, matrix, distortion, flags=flags, criteria=_criteria(cv2)
        )

    def unpacked(found: tuple[Any, ...]) -> Solution:
        _, matrix, distortion, rotations, translations = found
        return _unpacked(observations, matrix, np.ravel(distortion)[:count], rotations, translations)

    with _vendor_errors(cv2, observations):
        found = least(pixels, matrix, distortion, flags)
        if count >= TILTED or not _can_start(found[1], observations.image_size):
            return unpacked(found)  # OpenCV does not find the least there, or would not start from there again
        flags |= cv2.CALIB_USE_INTRINSIC_GUESS
        for _ in range(RESTARTS if count >= RATIONAL else 0):
            again = least(pixels, found[1], found[2], flags)
            if not again[0] < found[0]:
                break
            found = again
        exact = observations.detections
        lost = [p - d.pixels for p, d in zip(pixels, exact, strict=True)]
        if not any(part.any() for part in lost):
            return unpacked(found)
        further = [(p + MAGNIFIED * part).astype(np.float32) for p, part in zip(pixels, lost, strict=True)]
        return _without_rounding(unpacked(found), unpacked(least(further, found[1], found[2], flags)))


def _can_start(matrix: Any, image_size: tuple[int, int]) -> bool:
    """Whether OpenCV would take it as a start: focal lengths positive, the principal point in the image."""
    focal, middle = matrix.diagonal()[:2], matrix[:2, 2]
    return bool((focal > 0).all() and (middle >= 0).all() and (middle < image_size).all())


def _without_rounding(rounded: Solution, further: Solution) -> Solution:
    """Where OpenCV would end if it took pixels in double precision, to first order.

    Rounding moves its answer by what it moves pixels. What moving them `MAGNIFIED` times as far again does is seen
    above the rounding of the second answer's own pixels, and a part of it is what the first one was moved by.
    """
    params, translations = (one - (two - one) / MAGNIFIED for one, two in zip(rounded[::2], further[::2], strict=True))
    first, second = rotation_matrices(rounded[1]), rotation_matrices(further[1])
    back = rotation_matrices(-rotation_vectors(second @ first.transpose(0, 2, 1)) / MAGNIFIED)
    return params, rotation_vectors(back @ first), translations


def _solve_fisheye(observations: Observations, model: str, options: SolveOptions) -> Solution:
    import cv2

    if options.pixel_aspect is not None:
        raise InputError("OpenCV cannot hold the pixel aspect of a fisheye; leave it free or take another solver")
    start = initial_camera(observations, model, options.guess)
    flags = cv2.fisheye if hasattr(cv2.fisheye, "CALIB_FIX_SKEW") else cv2  # OpenCV 5 has moved them
    points, pixels = _vendor_points(observations, np.float64)
    with _vendor_errors(cv2, observations):
        _, matrix, distortion, rotations, translations = cv2.fisheye.calibrate(
            [p[None] for p in points],  # one row each: OpenCV 5 fails on columns
            [p[None] for p in pixels],
            observations.image_size,
            start.matrix,
            start.distortion.copy(),
            # without new extrinsics at each step OpenCV's iteration wanders off even from exact data
            flags=flags.CALIB_FIX_SKEW | flags.CALIB_RECOMPUTE_EXTRINSIC | flags.CALIB_USE_INTRINSIC_GUESS,
            criteria=_criteria(cv2),
        )
    return _unpacked(observations, matrix, np.ravel(distortion), rotations, translations)


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


def _vendor_points(observations: Observations, kind: type) -> tuple[list[Any], list[Any]]:
    """Board points (n, 3) in units of the spacing, and pixels (n, 2), of every used view."""
    board = observations.board
    points: list[Any] = [(board.points[d.ids] / board.spacing_m).astype(kind) for d in observations.detections]
    return points, [d.pixels.astype(kind) for d in observations.detections]


def _unpacked(observations: Observations, matrix: Any, distortion: Any, rotations: Any, translations: Any) -> Solution:
    params = np.concatenate([[matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]], distortion])
    rotations, translations = (np.reshape(vectors, (-1, 3)) for vectors in (rotations, translations))
    return params, rotations, translations * observations.board.spacing_m


@contextmanager
def _vendor_errors(cv2: ModuleType, observations: Observations) -> Iterator[None]:
    """OpenCV's errors as ours: its own are several lines long and tell of its source files."""
    try:
        yield
    except cv2.error as error:
        said = " ".join(str(error.err).split())
        message = f"OpenCV found no solution from {len(observations.used)} views: {said}"
        raise CalibrationFailedError(message) from error
