"""An old camera against new photographs: the verdict, and what it rests on."""

from dataclasses import replace

import numpy as np
import pytest
from bundle_worlds import solved
from json_page import assert_as_documented

from opencsp_calib import (
    Calibration,
    CalibrationFailedError,
    Camera,
    Checkerboard,
    InputError,
    Observations,
)
from opencsp_calib.check import Judged, check
from opencsp_calib.comparison import Difference
from opencsp_calib.synthetic import bowed, demo_camera, observe, seed_poses

BOARD = Checkerboard(9, 6, 0.1)
CAMERA = demo_camera()


def photographed(views: int = 14, noise_px: float = 0.05, seed: int = 1) -> Observations:
    return observe(CAMERA, BOARD, seed_poses(BOARD, CAMERA, views, seed), noise_px=noise_px, rng=seed)


def changed(**change: float) -> Camera:
    params = CAMERA.params.copy()
    for name, value in change.items():
        params[CAMERA.lens.parameter_names.index(name)] += value
    return replace(CAMERA, params=params)


def test_the_true_camera_is_ok() -> None:
    """Two sigmas of an rms over the image: by chance a few in a hundred fall outside."""
    verdicts = [check(CAMERA, photographed(seed=seed), solved).verdict for seed in range(6)]
    assert verdicts.count("ok") >= 5
    assert "wrong" not in verdicts


def test_a_turn_of_the_frame_is_no_change() -> None:
    """The true camera but for its principal point, moved by a third of a pixel: a turn, to second order."""
    verdicts = [check(changed(cx=0.3), photographed(noise_px=0.1, seed=seed), solved).verdict for seed in range(3)]
    assert verdicts.count("ok") >= 2  # by chance, a few in a hundred are not


@pytest.mark.parametrize("change", [{"fx": 13.5, "fy": 13.5}, {"k1": 0.02}, {"fx": 10.0}], ids=str)
def test_a_camera_refocused_or_knocked_is_wrong(change: dict[str, float]) -> None:
    found = check(changed(**change), photographed(), solved)
    assert found.verdict == "wrong"
    assert found.decisive.sigmas > 5


def test_another_focal_length_shows_at_infinity_only() -> None:
    """By half a percent: at the range of the board a shift of the camera makes up for it, and would pass for good."""
    found = check(changed(fx=13.5, fy=13.5), photographed(), solved)
    assert found.at_range.verdict == "ok"
    assert found.decisive is found.at_infinity
    assert found.at_infinity.difference.worst_px > 1


def test_between_two_and_five_sigmas_it_is_degraded() -> None:
    photographs = photographed(noise_px=0.02)
    far = check(changed(k1=0.01), photographs, solved)
    middling = check(changed(k1=0.01 * 3.5 / far.decisive.sigmas), photographs, solved)
    assert middling.verdict == "degraded"
    assert 2 < middling.decisive.sigmas < 5


def known_with(**change: object) -> Calibration:
    """A calibration made before, in which something is as given."""
    return replace(solved(photographed()), **change)


def verdict_of(rms_px: float, worst_px: float, predicted_px: float) -> str:
    """Of figures by hand: a shift of the given rms and maximum."""
    shift = np.zeros((1, 101, 2))
    shift[0, 0, 0] = worst_px
    shift[0, 1:, 0] = np.sqrt(max(0.0, (101 * rms_px**2 - worst_px**2) / 100))
    return Judged(Difference(np.zeros((1, 101, 2)), shift, np.eye(3), np.zeros(3), None), predicted_px).verdict


def test_the_rule() -> None:
    assert verdict_of(0.019, 0.05, 0.01) == "ok"
    assert verdict_of(0.021, 0.05, 0.01) == "degraded"
    assert verdict_of(0.051, 0.1, 0.01) == "wrong"
    assert verdict_of(0.3, 1.1, 0.1) == "wrong"
    assert verdict_of(0.9, 1.1, 0.8) == "degraded"  # too few photographs to call it ok
    assert verdict_of(1.7, 2.5, 0.8) == "degraded"  # or wrong
    assert verdict_of(4.1, 5.0, 0.8) == "wrong"


def test_the_uncertainty_of_the_camera_itself_counts_where_it_is_known() -> None:
    covariance = np.diag(np.array([1.0, 1.0, 1.0, 1.0, 0.01, 0.01, 1e-4, 1e-4]) ** 2)
    alone = check(changed(k1=0.004), photographed(noise_px=0.02), solved)
    known = check(changed(k1=0.004), photographed(noise_px=0.02), solved, known_with(covariance=covariance))
    assert known.decisive.predicted_px > 3 * alone.decisive.predicted_px
    assert (alone.verdict, known.verdict) == ("wrong", "ok")


def test_a_bent_board_does_not_make_a_good_camera_wrong_where_its_shape_was_solved_for() -> None:
    bent, poses = bowed(BOARD, 0.002), seed_poses(BOARD, CAMERA, 6, 4)
    known = known_with(board=bent)
    few = observe(CAMERA, bent, poses, noise_px=0.05, rng=4, nominal=BOARD)
    assert check(CAMERA, few, solved).verdict != "ok"
    found = check(CAMERA, few, solved, known)
    assert found.verdict == "ok"
    assert "board-solved-before" in {problem.code for problem in found.problems}
    assert check(changed(fx=13.5, fy=13.5), few, solved, known).verdict == "wrong"
    flat = check(CAMERA, photographed(), solved, known)  # of a board that is not bent: as given it explains them better
    assert flat.fresh.board == BOARD
    assert flat.verdict == "ok"
    larger = Checkerboard(9, 6, 0.2)
    assert check(CAMERA, photographed(), solved, known_with(board=bowed(larger, 0.002))).verdict == "ok"


def test_what_it_says() -> None:
    found = check(changed(fx=13.5, fy=13.5), photographed(), solved)
    assert_as_documented("check", found.as_json())
    assert found.as_json()["verdict"] == "wrong"
    assert 1.0 < found.at_range.difference.range_m < 10.0
    assert "at infinity the camera is" in found.reasons[0]
    assert found.view_rms_px.max() < 0.2  # residuals hardly see what moves the image's corners by
    assert found.decisive.difference.worst_px > 2.0


def test_a_camera_that_cannot_see_the_board_where_it_was_is_wrong_and_named() -> None:
    blind = replace(CAMERA, params=np.array([2703.4, 2703.4, 829.6, 626.3, -8.0, 0.0, 0.0, 0.0]))
    found = check(blind, photographed(), solved)
    assert found.verdict == "wrong"
    assert "view_" in found.reasons[2]


def test_other_sizes_and_hopeless_photographs_are_refused() -> None:
    with pytest.raises(InputError, match="813x618"):
        check(CAMERA.binned(2), photographed(), solved)
    with pytest.raises(CalibrationFailedError, match="fresh"):
        check(CAMERA, photographed(2), solved)
