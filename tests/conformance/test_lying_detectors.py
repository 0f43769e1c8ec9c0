"""Detectors that lie, one lie each."""

from dataclasses import replace

import numpy as np
import pytest
from lies import caught
from opencsp_calib_opencv.checkerboard import CheckerboardDetector

from opencsp_calib.detection import Detection
from opencsp_calib.image import Image


class Detector(CheckerboardDetector):
    """Ours, and one lie."""

    name = "liar"

    def detect(self, image, board):
        return self.lie(super().detect(image, board), board)

    def lie(self, seen, board):
        return seen


class Shifted(Detector):
    def lie(self, seen, board):
        return replace(seen, pixels=seen.pixels + 2.5)


class HalfAPixelOff(Detector):
    feature = "own"

    def lie(self, seen, board):
        return replace(seen, pixels=seen.pixels + 0.5)


class FromTheOtherEnd(Detector):
    def lie(self, seen, board):
        return replace(seen, ids=len(board.points) - 1 - seen.ids)


class ColumnsFirst(Detector):
    def lie(self, seen, board):
        order = np.arange(len(board.points)).reshape(board.rows, board.columns).T.ravel()
        return replace(seen, ids=order[seen.ids])


class CountsFromOne(Detector):
    def lie(self, seen, board):
        return replace(seen, ids=seen.ids + 1)


class FindsAFew(Detector):
    def lie(self, seen, board):
        return seen.keeping(seen.ids < 10)


class AlwaysFinds(Detector):
    def lie(self, seen, board):
        grid = np.stack(np.meshgrid(np.arange(board.columns), np.arange(board.rows)), axis=-1).reshape(-1, 2)
        return seen if len(seen) else Detection(np.arange(len(board.points)), 40.0 * grid + 100.0)


class GivesNoReason(Detector):
    def lie(self, seen, board):
        return seen if len(seen) else Detection.nothing("")


class RaisesForSmallImages(Detector):
    def detect(self, image, board):
        if min(image.size) < 10:
            raise ValueError
        return super().detect(image, board)


class ReturnsNone(Detector):
    def lie(self, seen, board):
        return seen if len(seen) else None


class EightBitsOnly(Detector):
    def detect(self, image, board):
        return super().detect(Image(image.name, image.pixels.astype(np.uint8)), board)


class WritesIntoTheImage(Detector):
    def detect(self, image, board):
        seen = super().detect(image, board)
        if image.pixels.flags.writeable:
            image.pixels[:5] = 0
        return seen


class ChangesItsMind(Detector):
    looks = 0

    def lie(self, seen, board):
        self.looks += 1
        return replace(seen, pixels=seen.pixels + 0.01 * self.looks)


class SupportsNothing(Detector):
    def supports(self, board):
        return False


class OfAStrangeFeature(Detector):
    feature = "blob"


DETECTOR_LIES = [
    (Shifted, "finds_corners_under_their_ids"),
    (HalfAPixelOff, "finds_corners_under_their_ids"),
    (FromTheOtherEnd, "finds_corners_under_their_ids"),
    (ColumnsFirst, "finds_corners_under_their_ids"),
    (CountsFromOne, "finds_corners_under_their_ids"),
    (FindsAFew, "finds_corners_under_their_ids"),
    (AlwaysFinds, "finds_nothing_where_nothing_is"),
    (GivesNoReason, "finds_nothing_where_nothing_is"),
    (RaisesForSmallImages, "never_raises_for_an_image"),
    (ReturnsNone, "never_raises_for_an_image"),
    (EightBitsOnly, "sees_the_same_in_sixteen_bits"),
    (WritesIntoTheImage, "leaves_the_image_alone"),
    (ChangesItsMind, "leaves_the_image_alone"),
    (SupportsNothing, "supports_some_board"),
    (OfAStrangeFeature, "supports_some_board"),
]


@pytest.mark.parametrize(("liar", "check"), DETECTOR_LIES, ids=lambda value: getattr(value, "__name__", value))
def test_a_lying_detector_is_caught(liar, check):
    assert caught(liar(), check)
