"""Promises of a detector: corners are where they were rendered, under their own ids, and nothing else is found.

Boards are rendered, so that where each corner is in the image is known to 1e-4 px.
"""

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from opencsp_calib.arrays import Floats, Ids
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.conformance.kit import Setup, promise
from opencsp_calib.detection import Detection
from opencsp_calib.image import Image
from opencsp_calib.interfaces import Detector
from opencsp_calib.pose import Pose
from opencsp_calib.registry import installed
from opencsp_calib.rendering import render
from opencsp_calib.synthetic import pose_in_view

__all__ = ["CHECKS"]

NEAR_PX = {"corner": 2.0, "own": 0.5}
"""How near corners must be: those that are refined afterwards only as near as the refinement needs."""
SIZE = (800, 640)
CAMERA = Camera("rendering", "opencv4", np.array([950.0, 950.0, 407.3, 309.8, -0.12, 0.05, 0.0006, -0.0004]), SIZE)
ROLLS_DEG = (0.0, 25.0, 90.0, 180.0, 270.0)


def supports_some_board(detector: Detector, setup: Setup) -> None:
    """It has a feature, and says yes to one of the setup's boards and no, without raising, to the others."""
    promise(detector.feature in NEAR_PX, f"its feature is {detector.feature!r}, expected one of {sorted(NEAR_PX)}")
    promise(_boards(detector, setup), "it supports none of the boards of the setup: give one that it does")


def finds_corners_under_their_ids(detector: Detector, setup: Setup) -> None:
    """Head-on and tilted, upright, turned and upside down: each corner within `NEAR_PX` of where it is rendered."""
    for board in _boards(detector, setup):
        for roll in ROLLS_DEG:
            for tilt in (0.0, 35.0):
                _promise_found(detector, board, roll, tilt)


def finds_nothing_where_nothing_is(detector: Detector, setup: Setup) -> None:
    """Nothing is found, and why is said, in an even image, in noise, and in stripes."""
    width, height = SIZE
    noise = np.random.default_rng(1).integers(0, 256, (height, width)).astype(np.uint8)
    stripes = np.where(np.arange(width)[None, :] // 20 % 2, 200, 40).astype(np.uint8) + np.zeros((height, 1), np.uint8)
    images = {"grey": np.full((height, width), 128, dtype=np.uint8), "noise": noise, "stripes": stripes}
    for board in _boards(detector, setup):
        for what, pixels in images.items():
            seen = detector.detect(Image(what, pixels), board)
            promise(len(seen) == 0, f"{board.spec}: it finds {len(seen)} corners in an image of nothing but {what}")
            promise(seen.reason.strip(), f"{board.spec}: it does not say why nothing was found in {what}")


def never_raises_for_an_image(detector: Detector, setup: Setup) -> None:
    """Tiny, long, black, white, 16-bit, saturated: whatever the image, it returns a Detection."""
    shapes = ((1, 1), (2, 3), (1, 500), (500, 2), (17, 31))
    images = [np.full(shape, level, dtype=np.uint8) for shape in shapes for level in (0, 255)]
    images += [np.full((60, 80), 65535, dtype=np.uint16), np.zeros((60, 80), dtype=np.uint16)]
    for board in _boards(detector, setup):
        for pixels in images:
            image = Image("strange", pixels)
            try:
                seen = detector.detect(image, board)
            except Exception as error:
                shape = f"{pixels.shape[1]}x{pixels.shape[0]} {pixels.dtype}"
                raise AssertionError(f"{board.spec}: it raises {error!r} for an image of {shape}") from error
            promise(isinstance(seen, Detection), f"{board.spec}: it returns {seen!r}, no Detection")


def sees_the_same_in_sixteen_bits(detector: Detector, setup: Setup) -> None:
    """The same image with 16 bits a pixel, also where only 12 of them are used, has the same corners."""
    for board in _boards(detector, setup):
        image, _ = _rendered(board, 0.0, 20.0)
        eight = detector.detect(image, board)
        for bits, white in ((16, 0), (12, 4095)):
            largest = 2**bits - 1
            pixels = np.round(image.pixels * (largest / 255.0)).astype(np.uint16)
            deep = detector.detect(Image("deep", pixels, white=white), board)
            promise(
                np.array_equal(np.sort(eight.ids), np.sort(deep.ids)), f"{board.spec}: other corners in {bits} bits"
            )
            off = np.abs(eight.pixels[np.argsort(eight.ids)] - deep.pixels[np.argsort(deep.ids)]).max(initial=0.0)
            promise(off < 0.1, f"{board.spec}: corners are {off:.3g} px elsewhere in {bits} bits")


def leaves_the_image_alone(detector: Detector, setup: Setup) -> None:
    """The image is as before, also where it cannot be written to, and a second look finds the same."""
    for board in _boards(detector, setup):
        image, _ = _rendered(board, 0.0, 20.0)
        before = image.pixels.copy()
        first = detector.detect(image, board)
        promise(np.array_equal(before, image.pixels), f"{board.spec}: it writes into the image")
        second = detector.detect(replace(image, pixels=_read_only(before)), board)
        same = np.array_equal(first.ids, second.ids) and np.array_equal(first.pixels, second.pixels)
        promise(same, f"{board.spec}: it finds other corners when it looks again")


CHECKS = (
    supports_some_board,
    finds_corners_under_their_ids,
    finds_nothing_where_nothing_is,
    never_raises_for_an_image,
    sees_the_same_in_sixteen_bits,
    leaves_the_image_alone,
)


def _boards(detector: Detector, setup: Setup) -> list[Board]:
    return [board for board in setup.boards if detector.supports(board)]


def _promise_found(detector: Detector, board: Board, roll_deg: float, tilt_deg: float) -> None:
    image, pose = _rendered(board, roll_deg, tilt_deg)
    where = f"{board.spec}, turned by {roll_deg:g} and tilted by {tilt_deg:g} degrees"
    seen = detector.detect(image, board)
    count = len(board.points)
    promise(len(seen) >= 0.9 * count, f"{where}: {len(seen)} of {count} corners, {seen.reason or 'and no reason'}")
    promise(seen.ids.min() >= 0 and seen.ids.max() < count, f"{where}: it names corners that the board does not have")
    off = _off(seen, board, pose, seen.ids)
    if board.symmetric:  # nothing tells from which end its ids begin
        off = min(off, _off(seen, board, pose, count - 1 - seen.ids), key=np.max)
    allowed = NEAR_PX[detector.feature]
    promise(
        off.max() <= allowed,
        f"{where}: corners are up to {off.max():.3g} px from where they are, allowed are {allowed:g} px "
        "(half a pixel: is a pixel's centre at 0? hundreds: are ids those of the board?)",
    )


def _off(seen: Detection, board: Board, pose: Pose, ids: Ids) -> Floats:
    """(n,) px how far the corners are from where those of these ids are rendered."""
    rendered = CAMERA.project(pose.transform(board.points[ids]))
    return np.asarray(np.linalg.norm(seen.pixels - rendered, axis=1))


def _rendered(board: Board, roll_deg: float, tilt_deg: float) -> tuple[Image, Pose]:
    """A photograph of the board, which whoever gets it may spoil, and its pose."""
    image, pose = _photograph(board.spec, roll_deg, tilt_deg)
    return replace(image, pixels=image.pixels.copy()), pose


@lru_cache(maxsize=64)  # of half a megabyte each: several checks, and detectors of one board, look at the same
def _photograph(spec: str, roll_deg: float, tilt_deg: float) -> tuple[Image, Pose]:
    board = installed().board(spec)
    roll, tilt = np.deg2rad([roll_deg, tilt_deg])
    turned = np.array([[np.cos(roll), -np.sin(roll), 0.0], [np.sin(roll), np.cos(roll), 0.0], [0.0, 0.0, 1.0]])
    tilted = np.array([[np.cos(tilt), 0.0, np.sin(tilt)], [0.0, 1.0, 0.0], [-np.sin(tilt), 0.0, np.cos(tilt)]])
    pose = pose_in_view(board, CAMERA, tilted @ turned, fill=0.85)
    drawing = installed().boards[board.kind].draw(board)
    return render(CAMERA, board, pose, drawing=drawing, samples=2, name="rendered"), pose


def _read_only(pixels: NDArray[Any]) -> NDArray[Any]:
    pixels.flags.writeable = False
    return pixels
