"""Photographs of checkerboards with known corners, for the studies of corners.

Images of 1626x1236 by `opencsp_calib.rendering`, which integrates the pattern in closed form over 4 x 4 cells a pixel
and is true to 1e-4 px (`results/renderer.md`); it shares no code with the fit. Light changes by 12 and 18 % across the
image, vignetting takes 15 %, contrast is 168 of 255, distortion k1 = -0.22, k2 = 0.15. The truth is OpenCV's
`projectPoints`.
"""

from dataclasses import dataclass, field, replace

import cv2
import numpy as np

from opencsp_calib import Camera, Checkerboard, Detection, Image, Pose
from opencsp_calib.corners import refine
from opencsp_calib.rendering import Exposure, Scene, render
from opencsp_calib.synthetic import turned

SIZE = (1626, 1236)
SPACING_M = 0.05
MOST_SQUARES = (22, 19)
START_OFF_PX = 0.7  # of the starts that are refined


@dataclass(frozen=True)
class Case:
    """What is photographed."""

    square_px: float = 55.0
    tilt_deg: float = 36.0
    exposure: Exposure = field(default_factory=Exposure)
    skirts_px: float = 0.0  # a tenth of the light is spread so wide
    scene: Scene = field(default_factory=Scene)
    seed: int = 0


@dataclass(frozen=True)
class View:
    """A photograph and its truth."""

    image: Image
    board: Checkerboard
    truth: np.ndarray
    square_px: float

    @property
    def start(self) -> np.ndarray:
        """(n, 2) px, off the truth in random directions."""
        angles = np.random.default_rng(1).uniform(0, 2 * np.pi, len(self.truth))
        return self.truth + START_OFF_PX * np.column_stack([np.cos(angles), np.sin(angles)])

    def refined(self) -> Detection:
        """The corners as we find them from the start."""
        ids = np.flatnonzero(inside(self.start, self.image.size))
        return refine(self.image, Detection(ids, self.start[ids]), self.board)

    def errors(self, detection: Detection) -> np.ndarray:
        """(n, 2) px."""
        return detection.pixels - self.truth[detection.ids]


def inside(pixels: np.ndarray, size: tuple[int, int], margin_px: float = 1.0) -> np.ndarray:
    """(n,) bool."""
    return np.all((pixels > margin_px) & (pixels < np.array(size) - 1 - margin_px), axis=1)


def photograph(case: Case) -> View:
    """The board turned about a random axis in the image plane, and rolled by up to 27 degrees."""
    rng = np.random.default_rng(1000 + case.seed)
    focal = 1.66 * SIZE[0]
    columns, rows = (int(0.85 * side / case.square_px - 1) for side in SIZE)
    board = Checkerboard(min(columns, MOST_SQUARES[0] - 1), min(rows, MOST_SQUARES[1] - 1), SPACING_M)
    azimuth, roll = rng.uniform(-np.pi, np.pi), rng.uniform(-0.47, 0.47)
    turn = turned(np.radians(case.tilt_deg), azimuth, roll)
    ray = np.array([*rng.uniform(-0.5, 0.5, 2) / focal, 1.0])
    translation = focal * SPACING_M / case.square_px * ray - turn @ board.points.mean(axis=0)
    params = [focal, focal, SIZE[0] / 2 + 7.8, SIZE[1] / 2 - 5.7, -0.22, 0.15, 6e-4, -4e-4]
    camera = Camera("study", "opencv4", params, SIZE)
    pose = Pose.from_matrix(turn, translation)
    image = _exposed(camera, board, pose, case)
    rotation, translation = np.array(pose.rotation), np.array(pose.translation)
    truth = cv2.projectPoints(board.points, rotation, translation, camera.matrix, np.array(camera.distortion))[0]
    return View(image, board, truth.reshape(-1, 2), case.square_px)


def _exposed(camera: Camera, board: Checkerboard, pose: Pose, case: Case) -> Image:
    """The image; with skirts, of two exposures of different blur added up."""
    if not case.skirts_px:
        return render(camera, board, pose, scene=case.scene, exposure=case.exposure, rng=case.seed)
    clean = replace(case.exposure, noise=0.0, bits=16)
    core, skirts = (
        render(camera, board, pose, scene=case.scene, exposure=replace(clean, psf_px=psf)).pixels / 257.0
        for psf in (case.exposure.psf_px, case.skirts_px)
    )
    grey = 0.9 * core + 0.1 * skirts
    grey += np.random.default_rng(case.seed).normal(0, case.exposure.noise, grey.shape)
    return Image("rendered", np.clip(np.rint(grey), 0, 255).astype(np.uint8))


def rms(errors: np.ndarray) -> float:
    """Per axis."""
    return float(np.sqrt(np.mean(errors**2)))


def squared_over_stated(errors: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """(n,), 1 on average where the covariance is honest."""
    return np.einsum("ni,nij,nj->n", errors, np.linalg.inv(covariance), errors) / 2
