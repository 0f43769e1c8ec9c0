"""To and from OpenCSP's own Camera class, where OpenCSP is installed."""

from typing import Any

import numpy as np

from opencsp_calib.camera import Camera
from opencsp_calib.errors import InputError, MissingDependencyError, NotExactError
from opencsp_calib.models import OPENCV_MODELS

__all__ = ["from_opencsp", "to_opencsp"]


def to_opencsp(camera: Camera) -> Any:
    """OpenCSP's Camera with the same intrinsics.

    Raises
    ------
    MissingDependencyError
        If OpenCSP is not installed.
    NotExactError
        If it is a fisheye camera, which OpenCSP's class cannot be.
    """
    if camera.model == "opencv_fisheye":
        raise NotExactError("OpenCSP's Camera has no fisheye lens; calibrate with an opencv model for OpenCSP")
    try:
        from opencsp.common.lib.camera.Camera import Camera as OpenCSPCamera  # type: ignore[import-not-found]
    except ImportError as error:
        raise MissingDependencyError(f"OpenCSP cannot be imported ({error}); install it first") from None
    distortion = camera.distortion if camera.distortion.size else np.zeros(4)
    return OpenCSPCamera(camera.matrix, distortion.copy(), camera.image_size, camera.name)


def from_opencsp(camera: Any) -> Camera:
    """Our Camera from OpenCSP's.

    Parameters
    ----------
    camera : opencsp.common.lib.camera.Camera.Camera
        Its ``intrinsic_mat``, ``distortion_coef``, ``image_shape_xy`` and ``name`` are taken.

    Raises
    ------
    InputError
        If it has skew, or a number of coefficients that OpenCV does not know.
    """
    matrix = np.asarray(camera.intrinsic_mat, dtype=np.float64)
    distortion = np.asarray(camera.distortion_coef, dtype=np.float64).ravel()
    if distortion.size not in OPENCV_MODELS:
        raise InputError(f"a camera with {distortion.size} distortion coefficients cannot be OpenCV's")
    if matrix[0, 1] != 0:
        raise InputError(f"the camera matrix has skew ({matrix[0, 1]:g}), which no lens model of ours has")
    params = np.concatenate([[matrix[0, 0], matrix[1, 1], matrix[0, 2], matrix[1, 2]], distortion])
    width, height = np.ravel(camera.image_shape_xy)
    return Camera(str(camera.name), OPENCV_MODELS[distortion.size], params, (int(width), int(height)))
