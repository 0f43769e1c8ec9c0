"""ArUco markers in a photograph, of any dictionary, black on white or white on black.

OpenCV finds the quadrilaterals; they are read here, all at once. OpenCV compares each in turn with each marker of one
dictionary, which takes seconds where there are many squares, and cannot say that the markers are of another.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import comb

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats, Ids
from opencsp_calib_opencv.levels import Level
from opencsp_calib_opencv.rings import sample

__all__ = ["Cells", "Markers", "cells_of", "dictionary_size", "found_quads", "quad_areas", "read_markers"]

MOST_SQUARES = 1500  # OpenCV compares all quadrilaterals with each other: half a second for so many, then ever more
LEAST_SIDE_PX = 8  # of a square that counts
LEAST_FILLED = 0.45  # of the box around it: a square on its tip fills half, a letter less
SAME_SIDE_RATE = 0.01  # of the perimeter; by OpenCV's default only the larger of a dark square and its marker is given
LEAST_CONTRAST = 0.03  # of the range, between the cells of a marker
MOST_WRONG_FRAME = 0.15  # of the cells around the code
CORRECTED = 0.6  # of the faults that a dictionary can correct, as OpenCV's default
WITHIN_CELL = np.array([-0.2, 0.0, 0.2])  # where a cell is looked at, from its middle
UNIT = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], dtype=np.float32)


@dataclass(frozen=True, eq=False)
class Cells:
    """Quadrilaterals with the frame of a marker, and what is inside.

    Parameters
    ----------
    corners : (n, 4, 2) px
        Clockwise.
    codes : (n, size, size)
        1 for white, -1 for black.
    """

    corners: Floats
    codes: Floats


@dataclass(frozen=True, eq=False)
class Markers:
    """Markers that were read.

    Parameters
    ----------
    ids : (n,)
    corners : (n, 4, 2) px
        Clockwise from the marker's own upper left.
    by_chance : float
        How many would have been read if there were random cells in all frames.
    """

    ids: Ids
    corners: Floats
    by_chance: float


def found_quads(level: Level, *, inverted: bool) -> Floats | None:
    """(n, 4, 2) px, quadrilaterals that may be black (white) markers, clockwise; None where there are too many."""
    import cv2

    pixels = level.stretched(inverted=inverted)
    if _squares(pixels) > MOST_SQUARES:
        return None
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    one = cv2.aruco.Dictionary(dictionary.bytesList[:1], dictionary.markerSize, 0)
    parameters = cv2.aruco.DetectorParameters()
    parameters.minMarkerDistanceRate = SAME_SIDE_RATE
    found, _, others = cv2.aruco.ArucoDetector(one, parameters).detectMarkers(pixels)
    return np.asarray(np.reshape(np.array([*found, *others], dtype=np.float64), (-1, 4, 2)))


def cells_of(level: Level, quads: Floats, size: int, *, inverted: bool) -> Cells:
    """What is in those of (n, 4, 2) quadrilaterals that have the frame of a marker of so many cells each way."""
    import cv2

    cells = size + 2
    middles = (np.arange(cells) + 0.5) / cells
    row, column, down, on = np.meshgrid(middles, middles, WITHIN_CELL / cells, WITHIN_CELL / cells, indexing="ij")
    places = np.stack([column + on, row + down], axis=-1).reshape(1, -1, 2).astype(np.float32)
    homographies = [cv2.getPerspectiveTransform(UNIT, quad) for quad in quads.astype(np.float32)]
    pixels = np.array([cv2.perspectiveTransform(places, homography)[0] for homography in homographies])
    levels = sample(level.sharp, pixels.reshape(-1, places.shape[1], 2))
    levels = levels.reshape(-1, cells, cells, WITHIN_CELL.size**2).mean(axis=3)
    levels = 1 - levels if inverted else levels
    ordered = np.sort(levels.reshape(-1, cells * cells), axis=1)
    quarter = cells * cells // 4
    dark, bright = ordered[:, :quarter].mean(axis=1), ordered[:, -quarter:].mean(axis=1)
    white = levels > ((dark + bright) / 2)[:, None, None]
    code = white[:, 1:-1, 1:-1]
    wrong = white.sum(axis=(1, 2)) - code.sum(axis=(1, 2))
    framed = (wrong <= MOST_WRONG_FRAME * 4 * (cells - 1)) & (bright - dark > LEAST_CONTRAST)
    return Cells(quads[framed], np.where(code[framed], 1.0, -1.0))


def read_markers(cells: Cells, dictionary: str, count: int, *, mirrored: bool = False) -> Markers:
    """Those that are one of the first `count` markers of a dictionary, or its mirror image; each once at a place."""
    known, most_wrong = _codes(dictionary, count)
    bits = known.shape[-1] ** 2
    codes = np.swapaxes(cells.codes, 1, 2) if mirrored else cells.codes
    quads = cells.corners[:, [0, 3, 2, 1]] if mirrored else cells.corners
    wrong = (bits - codes.reshape(-1, bits) @ known.reshape(-1, bits).T) / 2
    best = wrong.argmin(axis=1)
    faults = wrong[np.arange(len(wrong)), best]
    order = np.argsort(faults, kind="stable")
    order = order[faults[order] <= most_wrong]
    ids, turns = np.divmod(best[order], 4)
    corners = np.array([np.roll(quad, -turn, axis=0) for quad, turn in zip(quads[order], turns, strict=True)])
    alike = sum(comb(bits, faults) for faults in range(most_wrong + 1)) / 2.0**bits
    by_chance = len(codes) * min(1.0, len(known) * alike)
    return _once_each(Markers(ids.astype(np.int64), corners.reshape(-1, 4, 2), by_chance))


def dictionary_size(dictionary: str) -> int:
    """How many cells each way the code of its markers has."""
    return int(_codes(dictionary, 1)[0].shape[-1])


def quad_areas(quads: Floats) -> Floats:
    """(n,) px² of (n, 4, 2) quadrilaterals."""
    one, other = quads[:, 2] - quads[:, 0], quads[:, 3] - quads[:, 1]
    return np.asarray(np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]) / 2)


def _squares(pixels: NDArray[np.uint8]) -> int:
    """About how many dark things are as square, and at least as large, as a small marker."""
    import cv2

    mean = cv2.boxFilter(pixels, -1, (23, 23))
    stats = cv2.connectedComponentsWithStats(cv2.compare(pixels, mean, cv2.CMP_LT), connectivity=4)[2][1:]
    width, height, area = (stats[:, column] for column in (cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT, cv2.CC_STAT_AREA))
    return int(((np.minimum(width, height) >= LEAST_SIDE_PX) & (area > LEAST_FILLED * width * height)).sum())


def _once_each(markers: Markers) -> Markers:
    """Without what was found a second time at the same place; the first is the one with fewer faults."""
    first = np.ones(len(markers.ids), dtype=np.bool_)
    middles, sides = markers.corners.mean(axis=1), np.sqrt(quad_areas(markers.corners))
    for number, (marker, middle, side) in enumerate(zip(markers.ids, middles, sides, strict=True)):
        near = np.linalg.norm(middles[:number] - middle, axis=1) < side / 2
        first[number] = not (near & (markers.ids[:number] == marker)).any()
    return Markers(markers.ids[first], markers.corners[first], markers.by_chance)


@lru_cache(maxsize=64)
def _codes(dictionary: str, count: int) -> tuple[Floats, int]:
    """(4 count, size, size) each marker with its upper left at each corner in turn; and how many faults are allowed."""
    import cv2

    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, dictionary))
    bits = [known.getBitsFromByteList(entry[None], known.markerSize) for entry in known.bytesList[:count]]
    turned = [np.rot90(code, -turns) for code in bits for turns in range(4)]
    return np.where(np.array(turned) > 0, 1.0, -1.0), int(CORRECTED * known.maxCorrectionBits)
