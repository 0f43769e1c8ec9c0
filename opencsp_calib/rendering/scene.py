"""What is photographed, and how: everything about a rendered image that is not geometry."""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.errors import InputError

__all__ = ["Exposure", "Scene", "Spot", "room"]


@dataclass(frozen=True)
class Spot:
    """A round spot in the image: a reflection of a lamp, or something in the way.

    Parameters
    ----------
    x_px, y_px : float
        Its middle.
    radius_px : float
        Of what is in the way; of a reflection, the standard deviation of its light.
    level : float
        Grey level, of 255: that of what is in the way, or what a reflection adds in its middle.
    """

    x_px: float
    y_px: float
    radius_px: float
    level: float


@dataclass(frozen=True)
class Scene:
    """The board's colours and surroundings. All grey levels are of 255, whatever the depth of the image.

    Parameters
    ----------
    white, black : float
        Grey levels of the sheet and of its print in full light.
    margin_squares : float
        White around the squares, in squares; black for a board printed white on black.
    background : float
        Mean grey level of the room behind the board.
    clutter : float
        How far grey levels of the room differ from it; 0 for a plain wall.
    shading : (float, float)
        How much the light grows from left to right and from top to bottom, as a fraction of its mean.
    glare, occluders : tuple of Spot
        Reflections, and things before the board.
    room : int
        Which room: the same number gives the same one.
    """

    white: float = 190.0
    black: float = 22.0
    margin_squares: float = 0.8
    background: float = 95.0
    clutter: float = 45.0
    shading: tuple[float, float] = (0.12, -0.18)
    glare: tuple[Spot, ...] = ()
    occluders: tuple[Spot, ...] = ()
    room: int = 0


@dataclass(frozen=True)
class Exposure:
    """How the camera takes the photograph.

    Parameters
    ----------
    psf_px : float
        Standard deviation of the Gaussian part of the blur. The pixel's own width comes on top of it.
    defocus_px : float
        Radius of the disc that a point becomes when out of focus.
    motion_px : (float, float)
        How far and in which direction (x, y) the image moves while the shutter is open.
    vignetting : float
        How much light is lost in the corners of the image, as a fraction; grows with the square of the radius.
    gain : float
        Factor on all grey levels; above 1 white may be clipped.
    noise : float
        Standard deviation in grey levels of 255.
    bits : 8 or 16
        Depth of the image.

    Raises
    ------
    InputError
        If a blur or the noise is negative or larger than sensible, or the depth is another.
    """

    psf_px: float = 0.6
    defocus_px: float = 0.0
    motion_px: tuple[float, float] = (0.0, 0.0)
    vignetting: float = 0.15
    gain: float = 1.0
    noise: float = 2.0
    bits: int = 8

    def __post_init__(self) -> None:
        if not all(0.0 <= blur <= 30.0 for blur in (self.psf_px, self.defocus_px, *np.abs(self.motion_px))):
            raise InputError("blur must be between 0 and 30 px")
        if not self.noise >= 0.0:
            raise InputError(f"noise must not be negative, but is {self.noise}")
        if self.bits not in (8, 16):
            raise InputError(f"images have 8 or 16 bits, not {self.bits}")


def room(scene: Scene, x: Floats, y: Floats) -> Floats:
    """Grey levels (M, N) of what is behind the board, at x (N,) and y (M,) from 0 to 1 over the image.

    Large soft patches of light, and boxes with sharp sides: furniture, posters, tiles.
    """
    rng = np.random.default_rng(scene.room)
    levels = np.full((len(y), len(x)), scene.background)
    for frequency in (1.0, 2.0, 4.0):
        waves = rng.uniform(0.3, 1.0, 2) * frequency, rng.uniform(0.0, 2.0 * np.pi, 2)
        along_x = np.cos(2.0 * np.pi * waves[0][0] * x + waves[1][0])
        along_y = np.cos(2.0 * np.pi * waves[0][1] * y + waves[1][1])
        levels += 0.4 * scene.clutter / frequency * np.outer(along_y, along_x)
    for _ in range(40):
        left, top = rng.uniform(-0.1, 1.0, 2)
        width, height = rng.uniform(0.02, 0.35, 2) ** [1.0, 1.3]
        columns = slice(*np.searchsorted(x, [left, left + width]))
        rows = slice(*np.searchsorted(y, [top, top + height]))
        mixed = rng.uniform(0.3, 1.0)
        level = scene.background + scene.clutter * rng.normal()
        levels[rows, columns] += mixed * (level - levels[rows, columns])
    return np.asarray(np.maximum(levels, 0.0), dtype=np.float64)
