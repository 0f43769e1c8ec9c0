"""Rendered photographs of a checkerboard, and where OpenCV's projection says its corners are."""

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

from opencsp_calib import Board, Camera, Checkerboard, Detection, Image, Pose
from opencsp_calib.arrays import Floats
from opencsp_calib.registry import installed
from opencsp_calib.rendering import Exposure, Scene, render

BOARD = Checkerboard(11, 8, 0.03)
SIZE = (480, 360)


@dataclass(frozen=True)
class View:
    """A photograph, and where its corners are."""

    image: Image
    board: Board
    truth: Floats

    def found(self, off_px: float = 0.5, seed: int = 0) -> Detection:
        """Every corner, off by so much in random directions."""
        angles = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(self.truth))
        off = off_px * np.column_stack([np.cos(angles), np.sin(angles)])
        return Detection(np.arange(len(self.truth)), self.truth + off)

    def errors(self, detection: Detection) -> Floats:
        return detection.pixels - self.truth[detection.ids]

    def squared_over_stated(self, detection: Detection) -> Floats:
        """(n,) squared error over covariance, 1 on average where the covariance is honest."""
        assert detection.covariance is not None
        errors = self.errors(detection)
        return np.einsum("ni,nij,nj->n", errors, np.linalg.inv(detection.covariance), errors) / 2


def view(
    square_px: float = 28.0,
    tilt_deg: float = 35.0,
    seed: int = 0,
    *,
    board: Board = BOARD,
    size: tuple[int, int] = SIZE,
    focal_px: float = 700.0,
    k1: float = -0.2,
    middle: tuple[float, float] = (0.5, 0.5),
    scene: Scene | None = None,
    exposure: Exposure | None = None,
) -> View:
    """A board whose squares are about as large as asked, tilted in a direction and rolled as the seed has it."""
    rng = np.random.default_rng(seed)
    azimuth, roll = rng.uniform(0, 2 * np.pi), rng.uniform(-0.6, 0.6)
    tilt = Rotation.from_rotvec(np.radians(tilt_deg) * np.array([np.cos(azimuth), np.sin(azimuth), 0]))
    turn = tilt * Rotation.from_rotvec([0, 0, roll])
    params = [focal_px, focal_px, size[0] / 2 + 3.2, size[1] / 2 - 2.7, k1, 0.05, 5e-4, -5e-4]
    camera = Camera("test", "opencv4", params, size)
    distance = focal_px * board.spacing_m / square_px
    off_px = (np.array(middle) - 0.5) * size + rng.uniform(-0.5, 0.5, 2)
    ray = np.array([*off_px / focal_px, 1.0])
    centre = board.points.mean(axis=0)
    pose = Pose(turn.as_rotvec(), distance * ray - turn.apply(centre))
    drawing = installed().boards[board.kind].draw(board)
    image = render(camera, board, pose, drawing=drawing, scene=scene, exposure=exposure, rng=seed)
    truth = cv2.projectPoints(board.points, pose.rotation, pose.translation, camera.matrix, camera.distortion)[0]
    return View(image, board, truth.reshape(-1, 2))


def rms(errors: Floats) -> float:
    """Per axis."""
    return float(np.sqrt(np.mean(errors**2)))
