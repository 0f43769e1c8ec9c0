"""The compiled loops of the renderer: native/render.c says how they work."""

from collections.abc import Callable
from ctypes import c_int64
from functools import cache

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.native import array_of, native_function, result_of

__all__ = ["light_of"]


def light_of(
    places_x: Floats,
    places_y: Floats,
    step: int,
    inset: int,
    x_edges: Floats,
    y_edges: Floats,
    levels: Floats,
    sheet: Floats,
    light: Floats,
    behind: Floats,
    before: Floats,
    response: Floats,
) -> Floats:
    """The image of a pattern before noise.

    Parameters
    ----------
    places_x, places_y : (rows, columns) m
        Where on the pattern the nodes of a grid of pixels look, every `step` pixels.
    step : int
    inset : int
        Pixels from the first node to the first pixel wanted.
    x_edges, y_edges, sheet
        See `Pattern`.
    levels : (N, M)
        Grey level of each cell of the pattern in full light, 0 beside the sheet.
    light, behind, before : (height, width)
        Of each pixel wanted: the light that falls on the sheet, the grey level of what is behind it, and the grey
        level that is added whatever is there.
    response : (samples, samples, 2 m + 1, 2 m + 1)
        See `pixel_response`.

    Returns
    -------
    (height, width)
        Wrong within m pixels of the border, which does not see what is beyond it.
    """
    nodes, samples, size = places_x.shape[1], response.shape[0], response.shape[2]
    plain, seen = np.empty(light.shape), np.zeros(light.shape)
    cell, cubics = np.empty((samples, samples)), np.empty((2, nodes - 3, 3, 4))
    read = [np.ascontiguousarray(values, dtype=np.float64) for values in (x_edges, y_edges, levels, sheet)]
    _compiled()(
        places_x, places_y, nodes, step, inset, *read, *levels.shape, *light.shape, light, behind, before, plain, seen,
        response, samples, size, cell, cubics,
    )  # fmt: skip
    return seen


@cache
def _compiled() -> Callable[..., None]:
    line, plane = array_of(np.float64, 1), array_of(np.float64, 2)
    return native_function(
        "light_of",
        plane, plane, c_int64, c_int64, c_int64, line, line, plane, plane, c_int64, c_int64, c_int64, c_int64,
        plane, plane, plane, result_of(np.float64, 2), result_of(np.float64, 2),
        array_of(np.float64, 4), c_int64, c_int64, result_of(np.float64, 2), result_of(np.float64, 4),
    )  # fmt: skip
