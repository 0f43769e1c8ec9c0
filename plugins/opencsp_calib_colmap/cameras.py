"""Our cameras as COLMAP's, and back.

COLMAP puts the centre of the upper-left pixel at (0.5, 0.5) for every model; the parameters of the models below are
otherwise ours, in our order. Source: COLMAP, src/colmap/sensor/models.h, and doc/cameras.rst.
"""

import numpy as np

from opencsp_calib.arrays import Params

__all__ = ["HALF_PIXEL", "MODELS", "colmap_params", "our_params"]

HALF_PIXEL = 0.5  # to be added to pixels and to the principal point on the way to COLMAP
MODELS = {
    "pinhole": "PINHOLE",
    "opencv4": "OPENCV",
    "opencv8": "FULL_OPENCV",
    "opencv_fisheye": "OPENCV_FISHEYE",
}


def colmap_params(params: Params) -> Params:
    """COLMAP's parameters of one of `MODELS`, from ours."""
    return _shifted(params, HALF_PIXEL)


def our_params(params: Params) -> Params:
    """Our parameters of one of `MODELS`, from COLMAP's."""
    return _shifted(params, -HALF_PIXEL)


def _shifted(params: Params, by: float) -> Params:
    shifted = np.array(params, dtype=np.float64)
    shifted[2:4] += by
    return shifted
