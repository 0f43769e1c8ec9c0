"""Projections of other programs that are none of our lens models: what a fit is fitted to.

One formula a file. They work on (N, 3) points in our camera frame (x right, y down, z forward) or on (N, 2) plane
coordinates, before focal length and principal point, and are composed by the readers, as
``to_pixels(brown(equidistant(points), (k1, k2, k3, k4, k5, k6), (p1, p2)), fx, fy, cx, cy)``. What has no image is NaN.
"""

from opencsp_calib_formats.lens.brown import brown
from opencsp_calib_formats.lens.division import division
from opencsp_calib_formats.lens.double_sphere import double_sphere
from opencsp_calib_formats.lens.eucm import eucm
from opencsp_calib_formats.lens.fisheye import equidistant, equisolid
from opencsp_calib_formats.lens.fov import fov
from opencsp_calib_formats.lens.inverse_brown import INVERSE, inverse_brown
from opencsp_calib_formats.lens.ocam import ocam
from opencsp_calib_formats.lens.omni import omni
from opencsp_calib_formats.lens.plane import on_plane, to_pixels

__all__ = [
    "INVERSE",
    "brown",
    "division",
    "double_sphere",
    "equidistant",
    "equisolid",
    "eucm",
    "fov",
    "inverse_brown",
    "ocam",
    "omni",
    "on_plane",
    "to_pixels",
]
