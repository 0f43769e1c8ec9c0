"""The tilted sensor of OpenCV's 14-coefficient model (Scheimpflug): a homography after all other distortion.

With R = Ry(tau_y) Rx(tau_x), Rx = [1 0 0; 0 c s; 0 -s c], Ry = [c 0 -s; 0 1 0; s 0 c]::

    [x' y' 1] ~ [R22 0 -R02; 0 R22 -R12; 0 0 1] R [x y 1]

Source: OpenCV documentation, module calib3d, "Detailed Description".
"""

from collections.abc import Callable

import numpy as np

from opencsp_calib.arrays import Floats, Matrix

__all__ = ["tilt_jacobian", "tilt_matrix", "tilted"]


def tilt_matrix(tau_x: float, tau_y: float) -> Matrix:
    """The homography (3, 3) of the tilt angles in radians."""
    rotation = _about_y(tau_y) @ _about_x(tau_x)
    return _onto_plane(rotation) @ rotation


def tilted(plane: Floats, homography: Matrix) -> Floats:
    """(N, 2) coordinates, mapped by a homography."""
    mapped = np.asarray(plane @ homography[:, :2].T + homography[:, 2], dtype=np.float64)
    return mapped[:, :2] / mapped[:, 2:]


def tilt_jacobian(plane: Floats, tau_x: float, tau_y: float) -> tuple[Floats, Floats]:
    """Derivatives of `tilted`: (N, 2, 2) by the coordinates, (N, 2, 2) by the tilt angles."""
    homography = tilt_matrix(tau_x, tau_y)
    mapped = plane @ homography[:, :2].T + homography[:, 2]
    out = mapped[:, :2] / mapped[:, 2:]
    by_mapped = np.zeros((len(plane), 2, 3))
    by_mapped[:, 0, 0] = by_mapped[:, 1, 1] = 1.0 / mapped[:, 2]
    by_mapped[:, :, 2] = -out / mapped[:, 2:]
    homogeneous = np.column_stack([plane, np.ones(len(plane))])
    rotation = _about_y(tau_y) @ _about_x(tau_x)
    by_angles = [
        _onto_plane(change, last=0.0) @ rotation + _onto_plane(rotation) @ change
        for change in (_about_y(tau_y) @ _slope(_about_x, tau_x), _slope(_about_y, tau_y) @ _about_x(tau_x))
    ]
    by_tilt = np.stack([np.einsum("nij,nj->ni", by_mapped, homogeneous @ change.T) for change in by_angles], axis=2)
    return by_mapped @ homography[:, :2], by_tilt


def _about_x(angle: float) -> Matrix:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0.0, 0.0], [0.0, c, s], [0.0, -s, c]])


def _about_y(angle: float) -> Matrix:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def _slope(rotation: Callable[[float], Matrix], angle: float) -> Matrix:
    """Derivative of a rotation about a fixed axis by its angle: half of the difference a right angle to either side."""
    return 0.5 * (rotation(angle + np.pi / 2) - rotation(angle - np.pi / 2))


def _onto_plane(rotation: Matrix, last: float = 1.0) -> Matrix:
    return np.array([[rotation[2, 2], 0.0, -rotation[0, 2]], [0.0, rotation[2, 2], -rotation[1, 2]], [0.0, 0.0, last]])
