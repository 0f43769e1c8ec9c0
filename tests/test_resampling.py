"""Halves, folds and held-out views."""

from dataclasses import replace

import numpy as np
import pytest
from bundle_worlds import solved

from opencsp_calib import Checkerboard, InputError, Observations
from opencsp_calib.comparison import compare
from opencsp_calib.resampling import (
    compare_halves,
    folds,
    halves,
    held_out,
    known_corners,
    leaving_each_out,
    nearby_halves,
)
from opencsp_calib.synthetic import bowed, demo_camera, observe, seed_poses

BOARD = Checkerboard(8, 5, 0.1)
CAMERA = demo_camera()


def world(views: int, bow_m: float = 0.0, noise_px: float = 0.05) -> Observations:
    true = bowed(BOARD, bow_m)
    return observe(CAMERA, true, seed_poses(BOARD, CAMERA, views, 1), noise_px=noise_px, rng=2, nominal=BOARD)


def names(observations: Observations) -> list[str]:
    return [view.image for view in observations.used]


def test_halves_are_the_odd_and_the_even_of_the_used_views() -> None:
    whole = world(7)
    dropped = whole.dropping(["view_002"])
    odd, even = halves(dropped)
    assert names(odd) == ["view_001", "view_004", "view_006"]
    assert names(even) == ["view_003", "view_005", "view_007"]
    assert len(odd.views) == 7  # what was looked at stays on record
    with pytest.raises(InputError, match="at least four"):
        halves(whole.keeping(["view_001", "view_002", "view_003"]))


@pytest.mark.parametrize("count", [2, 5, 11])
def test_folds_hold_every_view_out_once(count: int) -> None:
    whole = world(11)
    held = []
    for training, test in folds(whole, count):
        assert not set(names(training)) & set(names(test))
        assert set(names(training)) | set(names(test)) == set(names(whole))
        held += names(test)
    assert sorted(held) == names(whole)
    for wrong in (1, 12):
        with pytest.raises(InputError, match="folds"):
            folds(whole, wrong)


def test_leaving_each_out() -> None:
    sets = leaving_each_out(world(4))
    assert [sorted(set(names(world(4))) - set(names(rest))) for rest in sets] == [[n] for n in names(world(4))]


def test_halves_of_exact_views_do_not_differ_and_noisy_ones_do() -> None:
    assert compare_halves(world(8, noise_px=0.0), solved).difference.worst_px < 1e-5
    noisy = compare_halves(world(8), solved)
    assert noisy.difference.rms_px == compare(noisy.first.camera, noisy.second.camera).rms_px > 0.01
    assert names(noisy.second.observations) == names(halves(world(8))[1])


@pytest.mark.parametrize("shape", ["flat", "free", "warp"])
def test_nearby_halves_are_those_solved_apart(shape: str) -> None:
    seen = world(16, bow_m=0.0 if shape == "flat" else 0.001)
    whole = solved(seen, board_shape=shape)
    apart = compare_halves(seen, lambda half: solved(half, board_shape=shape)).difference
    assert nearby_halves(whole).rms_px == pytest.approx(apart.rms_px, rel=0.05)
    assert nearby_halves(whole).shift == pytest.approx(apart.shift, abs=0.1 * apart.worst_px)


def test_held_out_rms_is_the_noise_and_knows_a_bent_board() -> None:
    """Per corner the noise is 0.05 sqrt(2); a pose fitted to 2 x 40 numbers takes 6 of them."""
    expected = 0.05 * np.sqrt(2) * np.sqrt(1 - 6 / 80)
    flat = held_out(folds(world(12), 4), solved)
    assert flat.rms_px == pytest.approx(expected, rel=0.1)
    assert sorted(flat.images) == names(world(12))
    assert flat.rms_px == pytest.approx(np.sqrt(np.mean(flat.view_rms_px**2)))
    bent = world(12, bow_m=0.002)
    assert held_out(folds(bent, 4), solved).rms_px > 5 * expected
    shaped = held_out(folds(bent, 4), lambda views: solved(views, board_shape="free"))
    assert shaped.rms_px < 1.3 * expected


def test_corners_that_were_not_solved_for_do_not_count() -> None:
    """A corner seen in one training view only: its place is unknown, and it must not spoil the held-out rms."""
    seen = world(10, bow_m=0.002)
    views = list(seen.views)
    for index in range(1, 9):
        views[index] = replace(views[index], detection=views[index].detection.keeping(np.arange(40) != 0))
    seen = replace(seen, views=tuple(views))
    training, test = seen.keeping(names(seen)[:9]), seen.keeping(names(seen)[9:])
    found = solved(training, board_shape="free")
    assert known_corners(found).tolist() == [False] + [True] * 39
    assert held_out(((training, test),), lambda _: found).rms_px < 0.1
