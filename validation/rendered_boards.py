"""Photographs of checkerboards whose corners are known: the renderer of the studies, which shares no code with the fit.

Each pixel is the mean of `SAMPLING` x `SAMPLING` samples of a scene that has gone through the optical psf. A sample
sees the printed pattern averaged over its own width along the board's axes, so that 4 x 4 samples leave no staircase.
Where the corners are comes from OpenCV's `projectPoints`, the image from inverting the distortion.
"""

from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline, make_interp_spline

Floats = NDArray[np.float64]

SAMPLING = 4
NODE_STEP_PX = 16  # spacing of the nodes at which the lens is inverted; a quintic spline lies between them


@dataclass(frozen=True)
class Scene:
    """A camera, a board before it, and light.

    Parameters
    ----------
    columns, rows : int
        Inner corners.
    spacing_m : float
    rotation, translation : (3,)
        Board to camera.
    matrix, distortion : (3, 3), (5,)
        As OpenCV has them.
    size : (int, int)
        Width and height.
    psf : str
        ``gaussian``; ``disc`` (defocus: a uniform disc, softened); ``tails`` (a tenth of the light in wide skirts).
    psf_px : float
        Standard deviation of the optical psf along one axis, before the pixel's own area.
    noise : float
        Standard deviation, grey levels of 255.
    black, white : float
        Of the printed pattern, grey levels of 255.
    shading : (float, float)
        Change of the light across half the image's width, in x and y, as a fraction.
    vignetting : float
        Loss of light in the image's corners, as a fraction.
    margin : float
        White border around the outer squares, in squares.
    depth : int
        8 or 16 bits.
    """

    columns: int
    rows: int
    spacing_m: float
    rotation: Floats
    translation: Floats
    matrix: Floats
    distortion: Floats = field(default_factory=lambda: np.zeros(5))
    size: tuple[int, int] = (1626, 1236)
    psf: str = "gaussian"
    psf_px: float = 0.6
    noise: float = 2.0
    black: float = 30.0
    white: float = 190.0
    shading: tuple[float, float] = (0.15, -0.1)
    vignetting: float = 0.2
    margin: float = 0.5
    depth: int = 8
    seed: int = 0

    def truth(self) -> Floats:
        """(K, 2) px, where the corners are."""
        y, x = np.mgrid[: self.rows, : self.columns]
        points = np.column_stack([x.ravel(), y.ravel(), np.zeros(x.size)]) * self.spacing_m
        rvec = np.asarray(self.rotation, dtype=np.float64)
        tvec = np.asarray(self.translation, dtype=np.float64)
        return cv2.projectPoints(points, rvec, tvec, self.matrix, self.distortion)[0].reshape(-1, 2)


def render(scene: Scene) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """(height, width) grey levels."""
    width, height = scene.size
    levels = np.empty((height, width))
    pad = int(np.ceil(4 * scene.psf_px)) + 2
    strip = 128
    for top in range(0, height, strip):
        bottom = min(top + strip, height)
        fine = _blurred(_pattern(scene, top - pad, bottom + pad, pad), scene)
        coarse = fine.reshape(bottom - top + 2 * pad, SAMPLING, width + 2 * pad, SAMPLING).mean(axis=(1, 3))
        levels[top:bottom] = coarse[pad:-pad, pad:-pad]
    levels *= _light(scene)
    levels += np.random.default_rng(scene.seed).normal(0, scene.noise, levels.shape)
    if scene.depth == 16:
        return np.clip(np.rint(levels * 257), 0, 65535).astype(np.uint16)
    return np.clip(np.rint(levels), 0, 255).astype(np.uint8)


def view(
    square_px: float, tilt_deg: float, seed: int = 0, fill: float = 0.85, distorted: bool = True, **changes: object
) -> Scene:
    """A scene in which the board's squares are about as large as asked, filling part of the image, tilted and rolled.

    Parameters
    ----------
    square_px : float
        Side of a square in the board's middle, seen straight on.
    tilt_deg : float
        Between the board's normal and the optical axis; its direction and the roll depend on the seed.
    fill : float
        How much of the image the board may fill; columns and rows follow (21 x 18 corners at most).
    changes
        Other fields of `Scene`.
    """
    rng = np.random.default_rng(1000 + seed)
    size = changes.get("size", (1626, 1236))
    width, height = size  # type: ignore[misc]
    focal = 1.66 * width
    columns = int(np.clip(fill * width / square_px - 1, 4, 21))
    rows = int(np.clip(fill * height / square_px - 1, 3, 18))
    roll, direction = rng.uniform(-np.pi, np.pi, 2)
    axis = np.array([np.cos(direction), np.sin(direction), 0])
    turn = cv2.Rodrigues(axis * np.radians(tilt_deg))[0] @ cv2.Rodrigues(np.array([0, 0, 0.15 * roll]))[0]
    middle = np.array([(columns - 1) / 2, (rows - 1) / 2, 0])
    distance = focal / square_px  # the spacing is one metre
    place = np.array([rng.uniform(-0.5, 0.5) / square_px, rng.uniform(-0.5, 0.5) / square_px, 1]) * distance
    matrix = np.array([[focal, 0, (width - 1) / 2 + 8.3], [0, focal, (height - 1) / 2 - 5.2], [0, 0, 1]])
    distortion = np.array([-0.22, 0.15, 0.0006, -0.0004, 0.0]) if distorted else np.zeros(5)
    rotation = cv2.Rodrigues(turn)[0].ravel()
    translation = place - turn @ middle
    fields = {"size": size, "distortion": distortion, "seed": seed, **changes}
    return Scene(columns, rows, 1.0, rotation, translation, matrix, **fields)  # type: ignore[arg-type]


def _pattern(scene: Scene, top: int, bottom: int, pad: int) -> NDArray[np.float32]:
    """Grey levels of the samples of the rows from `top` to `bottom`, before the psf."""
    width = scene.size[0]
    x_normal, y_normal = _undistorted(scene, -pad, width + pad, top, bottom)
    homography = np.column_stack([cv2.Rodrigues(scene.rotation)[0][:, :2], scene.translation])
    inverse = np.linalg.inv(homography)
    w = inverse[2, 0] * x_normal + inverse[2, 1] * y_normal + inverse[2, 2]
    u = (inverse[0, 0] * x_normal + inverse[0, 1] * y_normal + inverse[0, 2]) / w / scene.spacing_m
    v = (inverse[1, 0] * x_normal + inverse[1, 1] * y_normal + inverse[1, 2]) / w / scene.spacing_m
    wave = _stripes(u, scene.columns) * _stripes(v, scene.rows)  # +1 in the square before corner 0: dark
    inside = _within(u, -1, scene.columns) * _within(v, -1, scene.rows)
    paper = _within(u, -1 - scene.margin, scene.columns + scene.margin)
    paper = paper * _within(v, -1 - scene.margin, scene.rows + scene.margin)
    middle, half = (scene.white + scene.black) / 2, (scene.white - scene.black) / 2
    grey = inside * (middle - half * wave) + (1 - inside) * scene.white
    desk = 0.5 * middle
    return (paper * grey + (1 - paper) * desk).astype(np.float32)


def _stripes(u: Floats, corners: int) -> Floats:
    """+-1, changing sign at every line of corners, averaged over the width of a sample."""
    width = _sample_width(u)
    u = np.clip(u, -0.5, corners - 0.5)  # no change at the rim, where only black ends
    phase = u - np.rint(u)
    sign = 1 - 2 * np.mod(np.rint(u), 2)
    return -sign * np.clip(2 * phase / width, -1, 1)


def _within(u: Floats, low: float, high: float) -> Floats:
    """1 between two lines, 0 outside, averaged over the width of a sample."""
    width = _sample_width(u)
    return np.clip((u - low) / width + 0.5, 0, 1) * np.clip((high - u) / width + 0.5, 0, 1)


def _sample_width(u: Floats) -> Floats:
    """How far a board coordinate runs across a square sample (the width of a box of the trapezoid's variance)."""
    along_y, along_x = np.gradient(u)
    return np.hypot(along_x, along_y)


def _undistorted(scene: Scene, left: int, right: int, top: int, bottom: int) -> tuple[Floats, Floats]:
    """Ideal normalised coordinates of all samples of a region of pixels."""
    nodes_x = np.arange(left - 3 * NODE_STEP_PX, right + 4 * NODE_STEP_PX, NODE_STEP_PX, dtype=np.float64)
    nodes_y = np.arange(top - 3 * NODE_STEP_PX, bottom + 4 * NODE_STEP_PX, NODE_STEP_PX, dtype=np.float64)
    grid = np.stack(np.meshgrid(nodes_x, nodes_y), axis=-1)
    at_nodes = _undistort(grid, scene.matrix, scene.distortion)
    offset = (np.arange(SAMPLING) + 0.5) / SAMPLING - 0.5
    xs = (np.arange(left, right)[:, None] + offset).ravel()
    ys = (np.arange(top, bottom)[:, None] + offset).ravel()
    across, down = _spline_matrix(nodes_x, xs), _spline_matrix(nodes_y, ys)
    return down @ at_nodes[..., 0] @ across.T, down @ at_nodes[..., 1] @ across.T


def _spline_matrix(nodes: Floats, at: Floats) -> Floats:
    spline: BSpline = make_interp_spline(nodes, np.eye(len(nodes)), k=5)
    return np.asarray(spline(at))


def _undistort(pixels: Floats, matrix: Floats, distortion: Floats) -> Floats:
    """Newton's method on OpenCV's formula."""
    k1, k2, p1, p2, k3 = distortion
    target = (pixels - matrix[:2, 2]) / matrix[[0, 1], [0, 1]]
    ideal = target.copy()
    for _ in range(15):
        x, y = ideal[..., 0], ideal[..., 1]
        r2 = x * x + y * y
        radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
        slope = k1 + r2 * (2 * k2 + r2 * 3 * k3)
        fx = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x) - target[..., 0]
        fy = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y - target[..., 1]
        xx = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x
        xy = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y
        yy = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x
        det = xx * yy - xy * xy
        ideal -= np.stack([(yy * fx - xy * fy) / det, (xx * fy - xy * fx) / det], axis=-1)
    return ideal


def _blurred(fine: NDArray[np.float32], scene: Scene) -> NDArray[np.float32]:
    """The samples seen through the optical psf."""
    sigma = scene.psf_px * SAMPLING
    if scene.psf == "gaussian":
        return _gaussian(fine, sigma)
    if scene.psf == "tails":
        # a narrow core and a tenth of the light spread three times as wide: the same standard deviation altogether
        core = sigma / np.sqrt(0.9 + 0.1 * 9)
        return 0.9 * _gaussian(fine, core) + 0.1 * _gaussian(fine, 3 * core)
    if scene.psf == "disc":
        softening = 0.35 * sigma  # diffraction; the disc's own deviation along an axis is half its radius
        radius = 2 * np.sqrt(sigma**2 - softening**2)
        half = int(np.ceil(radius)) + 1
        y, x = np.mgrid[-half : half + 1, -half : half + 1]
        disc = np.clip(radius + 0.5 - np.hypot(x, y), 0, 1)
        return _gaussian(cv2.filter2D(fine, cv2.CV_32F, (disc / disc.sum()).astype(np.float32)), softening)
    raise ValueError(scene.psf)


def _gaussian(fine: NDArray[np.float32], sigma: float) -> NDArray[np.float32]:
    half = int(np.ceil(4.5 * sigma))
    kernel = np.exp(-0.5 * (np.arange(-half, half + 1) / sigma) ** 2)
    kernel /= kernel.sum()
    return np.asarray(cv2.sepFilter2D(fine, cv2.CV_32F, kernel, kernel))


def _light(scene: Scene) -> Floats:
    width, height = scene.size
    y, x = np.mgrid[:height, :width]
    x = (x - (width - 1) / 2) / (width / 2)
    y = (y - (height - 1) / 2) / (width / 2)
    corner = 1 + (height / width) ** 2
    return (1 + scene.shading[0] * x + scene.shading[1] * y) * (1 - scene.vignetting * (x * x + y * y) / corner)
