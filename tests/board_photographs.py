"""Photographs of boards with known corners, for the tests of detectors: small, so that hundreds can be made."""

from dataclasses import dataclass

import numpy as np
from effort import at_most
from scipy.spatial.transform import Rotation

from opencsp_calib import Board, Camera, Detection, Image, Pose
from opencsp_calib.arrays import Floats
from opencsp_calib.interfaces import Detector, Drawing
from opencsp_calib.opencv import opencv_on_one_thread
from opencsp_calib.rendering import Exposure, Scene, render
from opencsp_calib.synthetic import pose_in_view

SIZE = (800, 600)
NEAR_PX = 2.0  # what the fit of the corners starts from
MOST_S = 1.0


def detected(detector: Detector, image: Image, board: Board) -> Detection:
    """What is found in the time that one image may take, on one core, whatever it shows; if not all, with a reason."""
    with opencv_on_one_thread(), at_most(MOST_S):
        detection = detector.detect(image, board)
    assert len(detection) == len(board.points) or detection.reason
    return detection


def small_camera(focal_px: float = 1100.0, k1: float = -0.1, k2: float = 0.03, size: tuple[int, int] = SIZE) -> Camera:
    width, height = size
    return Camera("test", "opencv4", [focal_px, focal_px, width / 2 - 0.5, height / 2 - 0.5, k1, k2, 0, 0], size)


def turned(tilt_deg: float = 0.0, azimuth_deg: float = 0.0, roll_deg: float = 0.0) -> Floats:
    """Board to camera, (3, 3)."""
    azimuth = np.radians(azimuth_deg)
    tilt = Rotation.from_rotvec(np.radians(tilt_deg) * np.array([np.cos(azimuth), np.sin(azimuth), 0]))
    return np.asarray((tilt * Rotation.from_rotvec([0, 0, np.radians(roll_deg)])).as_matrix())


@dataclass(frozen=True)
class Photograph:
    """An image of a board, and where its corners are."""

    image: Image
    board: Board
    pixels: Floats

    @classmethod
    def of(
        cls,
        board: Board,
        *,
        tilt_deg: float = 25.0,
        azimuth_deg: float = 40.0,
        roll_deg: float = 8.0,
        fill: float = 0.8,
        position: tuple[float, float] = (0.5, 0.5),
        shift: tuple[float, float] = (0.0, 0.0),
        camera: Camera | None = None,
        drawing: Drawing | None = None,
        scene: Scene | None = None,
        exposure: Exposure | None = None,
        rng: int = 0,
    ) -> "Photograph":
        """Shift moves the board out of view, in parts of the image's width and height."""
        camera = camera or small_camera()
        pose = pose_in_view(board, camera, turned(tilt_deg, azimuth_deg, roll_deg), fill, position)
        across = np.array(shift) * camera.image_size / camera.params[:2] * pose.translation[2]
        pose = Pose(pose.rotation, pose.translation + np.array([*across, 0.0]))
        image = render(camera, board, pose, drawing=drawing, scene=scene, exposure=exposure, rng=rng, samples=2)
        return cls(image, board, camera.project(pose.transform(board.points)))

    def farthest_px(self, detection: Detection) -> float:
        """How far a detected corner is from where it should be, at most: with the ids as they are."""
        return float(np.linalg.norm(detection.pixels - self.pixels[detection.ids], axis=1).max(initial=0))

    def farthest_alike_px(self, detection: Detection) -> float:
        """The same, where the board looks the same after some turns, in the best of them."""
        return float(self.off_px(detection).max(initial=0))

    def off_px(self, detection: Detection) -> Floats:
        """(n,) px, how far off each corner is, in the best of the turns after which the board looks the same."""
        columns, rows = self.board.grid
        ids = np.arange(columns * rows).reshape(rows, columns)
        turns = [0]
        if self.board.symmetric:
            turns = [0, 1, 2, 3] if columns == rows and columns % 2 == 0 else [0, 2]
        alike = [self.pixels[np.rot90(ids, n).ravel()[detection.ids]] for n in turns]
        return min((np.linalg.norm(detection.pixels - where, axis=1) for where in alike), key=np.sum)
