"""How to solve: everything a solver can be asked for."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

from opencsp_calib.camera import Camera
from opencsp_calib.errors import InputError

__all__ = ["PRESETS", "BoardShape", "PixelAspect", "SolveOptions", "Weights"]

BoardShape: TypeAlias = Literal["flat", "warp", "free"]
Weights: TypeAlias = Literal["equal", "covariance"]
PixelAspect: TypeAlias = Literal["free", "square"] | float

PRESETS: Mapping[str, Mapping[str, Any]] = {
    "opencsp": {
        "detector": "opencsp",
        "refine": "none",
        "solver": "opencv",
        "model": "opencv4",
        "board_shape": "flat",
        "pixel_aspect": "free",
        "weights": "equal",
        "robust": False,
    }
}
"""Options of `pipeline.detect` and `pipeline.solve` that belong together; ``opencsp`` is what OpenCSP itself does."""


@dataclass(frozen=True)
class SolveOptions:
    """What a solver is asked for; asking for what it is not able to do is an error.

    Parameters
    ----------
    guess : Camera, optional
        Where to start from.
    board_shape : 'flat', 'warp' or 'free'
        Whether the board is taken as it is given, gets a smooth warp, or every corner's position is solved for.
    pixel_aspect : float, optional
        fy/fx held at this ratio (1 for square pixels); None leaves it free.
    weights : 'equal' or 'covariance'
        Whether all corners count the same, or each by its covariance.
    robust : bool
        Whether outlying corners are found and left out.
    """

    guess: Camera | None = None
    board_shape: BoardShape = "flat"
    pixel_aspect: float | None = None
    weights: Weights = "equal"
    robust: bool = False

    def __post_init__(self) -> None:
        for name, words in (("board_shape", get_args(BoardShape)), ("weights", get_args(Weights))):
            if getattr(self, name) not in words:
                raise InputError(f"{name} is one of {', '.join(words)}, not {getattr(self, name)!r}")
        if self.pixel_aspect is not None and not (math.isfinite(self.pixel_aspect) and self.pixel_aspect > 0):
            raise InputError(f"the pixel aspect (fy/fx) must be a positive number, not {self.pixel_aspect}")

    @property
    def asked(self) -> frozenset[str]:
        """The solver abilities that these options need."""
        needed = {
            "guess": self.guess is not None,
            "board_warp": self.board_shape == "warp",
            "board_free": self.board_shape == "free",
            "pixel_aspect": self.pixel_aspect is not None,
            "weights": self.weights == "covariance",
            "robust": self.robust,
        }
        return frozenset(ability for ability, is_needed in needed.items() if is_needed)
