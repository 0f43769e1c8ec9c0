"""Photographs of a board by a known camera from a known pose, whose every corner is where it should be."""

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats
from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.drawing import Drawing, checkerboard_drawing
from opencsp_calib.drawing.pattern import pattern_of
from opencsp_calib.errors import InputError
from opencsp_calib.image import Image
from opencsp_calib.pose import Pose
from opencsp_calib.rendering.blur import pixel_response
from opencsp_calib.rendering.kernel import light_of
from opencsp_calib.rendering.scene import Exposure, Scene, Spot, room
from opencsp_calib.rendering.surface import look_up

__all__ = ["render"]


def render(
    camera: Camera,
    board: Board,
    pose: Pose,
    *,
    drawing: Drawing | None = None,
    scene: Scene | None = None,
    exposure: Exposure | None = None,
    rng: np.random.Generator | int = 0,
    samples: int = 4,
    name: str = "rendered",
) -> Image:
    """A photograph of a board, as the camera would take it.

    The corner with board point P is at ``camera.project(pose.transform(P))`` in the image, to better than 1e-4 px.
    The pattern is integrated, not sampled, over `samples` x `samples` cells a pixel, which are then spread by a blur
    that is symmetric and never only Gaussian; nothing is shared with the models that corners are fitted with.

    Parameters
    ----------
    camera : Camera
    board : Board
        Flat or shaped: its surface goes through its points, smoothly between them.
    pose : Pose
        Board to camera.
    drawing : Drawing, optional
        What is printed on it (`BoardKind.draw`); needed for all but plain checkerboards.
    scene : Scene, optional
        Colours, background, reflections, things in the way.
    exposure : Exposure, optional
        Blur, noise, depth.
    rng : Generator or int
        Of the noise.
    samples : int
        Cells across a pixel.
    name : str
        Of the image.

    Returns
    -------
    Image

    Raises
    ------
    InputError
        If it is not known what is printed on the board.
    """
    scene, exposure = scene or Scene(), exposure or Exposure()
    spread = pixel_response(exposure.psf_px, exposure.defocus_px, exposure.motion_px, samples)
    border = spread.shape[2] // 2
    pattern = pattern_of(drawing or _drawing(board), scene.margin_squares * board.spacing_m)
    nodes = look_up(camera, board, pose, border)
    levels = (scene.black + (scene.white - scene.black) * pattern.white) * pattern.sheet
    light, behind, before = _lighting(camera.image_size, border, scene, exposure)
    places = (nodes.x, nodes.y, nodes.step_px, -border - nodes.first_px)
    cells = (pattern.x_edges, pattern.y_edges, levels, pattern.sheet)
    grey = light_of(*places, *cells, light, behind, before, spread)
    return Image(name, _exposed(grey[border : -border or None, border : -border or None], exposure, rng))


def _drawing(board: Board) -> Drawing:
    if not isinstance(board, Checkerboard):
        raise InputError(f"to render a {board.kind}, give its drawing (BoardKind.draw makes it)")
    return checkerboard_drawing(board)


def _lighting(size: tuple[int, int], border: int, scene: Scene, exposure: Exposure) -> tuple[Floats, Floats, Floats]:
    """Light on the board, level behind it, level added before it, of all pixels and a border of more."""
    width, height = size
    x = (np.arange(-border, width + border) + 0.5) / width
    y = (np.arange(-border, height + border) + 0.5) / height
    aspect = height / width
    radius2 = ((x - 0.5) ** 2 + (aspect * (y - 0.5))[:, None] ** 2) / (0.25 + 0.25 * aspect**2)
    lamp = 1.0 + scene.shading[0] * (x - 0.5) + scene.shading[1] * (y - 0.5)[:, None]
    falloff = np.maximum(1.0 - exposure.vignetting * radius2, 0.0) * exposure.gain
    light = np.maximum(lamp, 0.0) * falloff
    behind = room(scene, x, y) * falloff
    before = np.zeros_like(light)
    for spot in scene.occluders:
        clear = np.clip(_distance(spot, border, light.shape) - spot.radius_px + 0.5, 0.0, 1.0)
        light, behind = light * clear, behind * clear
        before = before * clear + spot.level * exposure.gain * (1.0 - clear)
    for spot in scene.glare:
        far = _distance(spot, border, light.shape) / spot.radius_px
        before += spot.level * exposure.gain * np.exp(-0.5 * far**2)
    return light, behind, before


def _distance(spot: Spot, border: int, shape: tuple[int, ...]) -> Floats:
    y, x = np.ogrid[-border : shape[0] - border, -border : shape[1] - border]
    return np.asarray(np.hypot(x - spot.x_px, y - spot.y_px), dtype=np.float64)


def _exposed(
    grey: Floats, exposure: Exposure, rng: np.random.Generator | int
) -> NDArray[np.uint8] | NDArray[np.uint16]:
    """With noise, clipped and rounded to whole numbers."""
    if exposure.noise > 0:
        grey = grey + exposure.noise * np.random.default_rng(rng).standard_normal(grey.shape, dtype=np.float32)
    if exposure.bits == 8:
        return np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return np.clip(np.rint(grey * 257.0), 0, 65535).astype(np.uint16)
