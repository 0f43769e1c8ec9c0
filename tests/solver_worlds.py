"""Worlds that the solvers' tests share, and other programs' solutions to hold against."""

import h5py
import numpy as np

from opencsp_calib.board import Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.comparison import compare
from opencsp_calib.detection import Detection, Observations, View
from opencsp_calib.synthetic import demo_camera, observe, seed_poses

SEED_BOARD = Checkerboard(22, 19, 0.05)


def seed_world(views=20, noise_px=0.0, board=SEED_BOARD, given=None, camera=None):
    """The seed's procedure: camera, poses and observations."""
    camera = camera or demo_camera()
    poses = seed_poses(board, camera, views)
    return camera, poses, observe(camera, board, poses, noise_px=noise_px, nominal=given or board, rng=1)


def worst_px(a: Camera, b: Camera) -> float:
    """Largest difference over the image, frames aligned."""
    return compare(a, b).worst_px


def sandia(data_dir):
    """The seed's own corners of Sandia's ten images, as OpenCSP has stored them, and its result."""
    with h5py.File(data_dir / "sandia_checkerboard" / "expected_opencsp.h5") as file:
        expected = {name: file[name][()] for name in file if name != "image_shape_xy"}
    views = [
        View(f"{number:03}.png", Detection(np.arange(pixels.shape[1]), pixels.T.astype(np.float64)), "used")
        for number, pixels in enumerate(expected["p_image_points"], start=1)
    ]
    return Observations(Checkerboard(18, 23, 0.05), (1626, 1236), tuple(views)), expected
