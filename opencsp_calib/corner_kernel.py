"""The compiled fit of the image of a checkerboard's corner: native/corner_kernel.h says how it works."""

from collections.abc import Callable
from ctypes import c_double, c_int32, c_int64
from functools import cache

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats
from opencsp_calib.native import array_of, native_function, result_of

__all__ = ["DIAGNOSTICS", "FAILED", "PARAMETERS", "RAMP_PX", "fit_corners"]

PARAMETERS = 11
DIAGNOSTICS = 23
FAILED = 2  # of a status; 0 is converged, 1 outside of the image
RAMP_PX = 1.5  # over which a pixel's weight falls to nothing at the border of the window


def fit_corners(
    image: NDArray[np.uint8] | NDArray[np.uint16],
    white: float,
    parameters: Floats,
    bends: Floats,
    windows: Floats,
    tolerance: float,
    most_steps: int,
    *,
    examine: bool,
) -> Floats:
    """Fit corner after corner.

    Parameters
    ----------
    image : (height, width) uint8 or uint16
    white : float
        Grey level from which on a pixel is saturated.
    parameters : (n, 11)
        In: where to begin. Out: x, y px, angle of edge 1, of edge 2 rad, s px, a, b grey levels, and the gradients of a
        and b, in x and y, per px.
    bends : (n, 2) 1/px
        Curvature of each edge.
    windows : (n, 4) px
        Half the window along each edge; how far from an edge, in the direction of the other, pixels count at all.
    tolerance : float
        Of the position, px.
    most_steps : int
    examine : bool
        Whether all that is found is wanted, not only the status.

    Returns
    -------
    (n, 23)
        Status; variance of residuals, without what is alike on opposite sides of the corner; variance without what is
        alike in neighbouring pixels; the inverse normal matrix of x and y (xx, xy, yy); how x, then y, responds to each
        edge's bend, px per 1/px; for each quarter of the window its mean residual over the amplitude, its share of
        saturated pixels, its weight (quarters 0 and 3 are opposite each other); variance of residuals.
    """
    found = np.zeros((len(parameters), DIAGNOSTICS))
    height, width = image.shape
    _compiled(image.itemsize)(
        image,
        image.itemsize,
        height,
        width,
        white,
        len(parameters),
        parameters,
        bends,
        windows,
        tolerance,
        most_steps,
        examine,
        found,
    )
    return found


@cache
def _compiled(pixel_bytes: int) -> Callable[..., None]:
    return native_function(
        "fit_corners",
        array_of(np.uint8 if pixel_bytes == 1 else np.uint16, 2), c_int32, c_int64, c_int64, c_double, c_int64,
        result_of(np.float64, 2), array_of(np.float64, 2), array_of(np.float64, 2),
        c_double, c_int32, c_int32, result_of(np.float64, 2),
    )  # fmt: skip
