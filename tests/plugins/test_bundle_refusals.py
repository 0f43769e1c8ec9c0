"""The solver ``bundle``: views that decide nothing, or not all, are refused or said to."""

import numpy as np
import pytest
from bundle_worlds import SMALL, changed, codes, small_world, solved

from opencsp_calib.board import Checkerboard
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.synthetic import demo_camera, observe, pose_in_view


@pytest.mark.parametrize("shape", ["warp", "free"])
def test_boards_all_the_same_way_up_leave_the_aspect_open(shape):
    upright = small_world(12, noise_px=0.1, roll_deg=(-15.0, 15.0))
    assert "pixel-aspect-open" in codes(solved(upright, board_shape=shape))
    assert "pixel-aspect-open" not in codes(solved(upright, board_shape=shape, pixel_aspect=1.0))
    assert "pixel-aspect-open" not in codes(solved(upright))
    assert "pixel-aspect-open" not in codes(solved(small_world(12, noise_px=0.1), board_shape=shape))


def head_on(*fills):
    return tuple(
        pose_in_view(SMALL, demo_camera(), np.eye(3), fill, place)
        for fill in fills
        for place in ((0, 0), (0.5, 0.5), (1, 1))
    )


@pytest.mark.parametrize("noise_px", [0.0, 0.1, 1.0])
@pytest.mark.parametrize("model", ["pinhole", "opencv4", "opencv_fisheye"])
def test_boards_all_parallel_do_not_determine_the_focal_length(noise_px, model):
    observations = observe(demo_camera(), SMALL, head_on(0.4, 0.6, 0.9), noise_px=noise_px)
    with pytest.raises(CalibrationFailedError, match=r"9 views do not determine the focal length.*tilted"):
        solved(observations, model)


def test_too_little_is_refused_with_a_reason():
    world = small_world(6, noise_px=0.1)
    first = [view.image for view in world.views]
    with pytest.raises(InputError, match="1 usable view"):
        solved(world.keeping(first[:1]))
    with pytest.raises(CalibrationFailedError, match="2 views do not determine"):
        solved(world.keeping(first[:2]), board_shape="free")
    rng = np.random.default_rng(0)
    sparse = changed(world, lambda i, d: d.keeping(np.isin(d.ids, rng.permutation(len(d) // 2)[:9])))
    with pytest.raises(CalibrationFailedError, match=r"too few for the .* unknowns of 'opencv4' with a free board"):
        solved(sparse, board_shape="free")
    apart = changed(world, lambda i, d: d.keeping(d.ids >= 50 if i == 2 else d.ids < 50))
    with pytest.raises(CalibrationFailedError, match="all but 0 corners of view_003 are in no other view"):
        solved(apart, board_shape="free")


def test_the_wrong_board_does_not_fit():
    with pytest.raises(CalibrationFailedError, match="do not fit the board"):
        solved(small_world(8, noise_px=0.1).with_board(Checkerboard(7, 9, 0.04)))
