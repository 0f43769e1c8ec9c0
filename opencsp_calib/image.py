"""A photograph in memory: grey levels, and where they came from."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.errors import InputError

__all__ = ["Image"]


@dataclass(frozen=True, eq=False)
class Image:
    """Grey levels of one photograph.

    Parameters
    ----------
    name : str
        What reports call it; unique within a set.
    pixels : (height, width) uint8 or uint16
        The sensor's own pixels: never rotated, never resampled.
    sha256 : str
        Of the file it was read from, hexadecimal; empty if it never was a file.
    white : int
        The grey level at which a pixel is saturated; 0 means the largest its type can hold.
    record : mapping of str to str
        What its source tells of it: camera, exposure, binning, region of the sensor, time.
    """

    name: str
    pixels: NDArray[np.uint8] | NDArray[np.uint16]
    sha256: str = ""
    white: int = 0
    record: Mapping[str, str] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        if self.pixels.ndim != 2 or self.pixels.dtype not in (np.uint8, np.uint16) or self.pixels.size == 0:
            given = f"{self.pixels.shape} of {self.pixels.dtype}"
            raise InputError(f"image {self.name} must be (height, width) of uint8 or uint16, not {given}")
        if not self.white:
            object.__setattr__(self, "white", int(np.iinfo(self.pixels.dtype).max))
        object.__setattr__(self, "record", MappingProxyType(dict(self.record)))

    @property
    def size(self) -> tuple[int, int]:
        """Width and height in pixels."""
        return self.pixels.shape[1], self.pixels.shape[0]
