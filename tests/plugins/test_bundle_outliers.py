"""The solver ``bundle``: planted outliers are found and named, and unequal corners weighted."""

from dataclasses import replace

import numpy as np
import pytest
from bundle_worlds import changed, codes, small_world, solved, spoilt
from solver_worlds import seed_world, worst_px

from opencsp_calib.errors import CalibrationFailedError
from opencsp_calib.synthetic import demo_camera


@pytest.mark.parametrize("shape", ["flat", "free"])
@pytest.mark.parametrize(("share", "size_px"), [(0.01, 2.0), (0.02, 60.0), (0.15, 10.0)])
def test_outliers_are_found_and_named(shape, share, size_px):
    observations, masks = spoilt(small_world(15, noise_px=0.1), share, size_px)
    calibration = solved(observations, board_shape=shape, robust=True)
    for found, planted in zip(calibration.outliers, masks, strict=True):
        np.testing.assert_array_equal(found, planted)
    without = changed(observations, lambda i, d: d.keeping(~masks[i]))
    clean = solved(without, board_shape=shape)
    assert worst_px(calibration.camera, clean.camera) < 1e-6
    assert calibration.rms_px == pytest.approx(clean.rms_px, abs=1e-9)
    assert ("many-outliers" in codes(calibration)) == (share > 0.03)


def test_nothing_is_an_outlier_of_normal_noise():
    assert solved(seed_world(20, 0.15)[2], robust=True, weights="covariance").rejected_corners == 0


def test_a_blurred_view_is_no_heap_of_outliers_but_a_view_of_rubbish_is_named():
    rng = np.random.default_rng(2)
    good = small_world(10, noise_px=0.05)

    def blurred(size_px):
        return changed(
            good, lambda i, d: replace(d, pixels=d.pixels + (i == 3) * size_px * rng.normal(size=(len(d), 2)))
        )

    assert solved(blurred(0.15), robust=True).rejected_corners == 0
    with pytest.raises(CalibrationFailedError, match="view_004 are outliers"):
        solved(blurred(300.0), robust=True)


def test_weights_make_the_most_of_unequal_corners():
    """Half of the views ten times as noisy: weighted by their covariance they hardly harm."""
    rng = np.random.default_rng(6)
    noise = [0.02 if i % 2 else 0.2 for i in range(16)]
    exact = small_world(16)

    def noisy(index, d):
        shift = noise[index] * rng.normal(size=(len(d), 2))
        return replace(d, pixels=d.pixels + shift, covariance=np.tile(noise[index] ** 2 * np.eye(2), (len(d), 1, 1)))

    errors = {"equal": [], "covariance": []}
    for _ in range(6):
        observations = changed(exact, noisy)
        for weights, found in errors.items():
            found.append(worst_px(demo_camera(), solved(observations, weights=weights).camera))
    assert np.mean(errors["covariance"]) < 0.4 * np.mean(errors["equal"])


def test_corners_without_covariance_count_equally_and_are_mentioned():
    noisy = small_world(8, noise_px=0.1)
    bare = changed(noisy, lambda i, d: replace(d, covariance=None))
    calibration = solved(bare, weights="covariance")
    assert worst_px(calibration.camera, solved(bare).camera) < 1e-9
    assert "corners-without-covariance" in codes(calibration)
    some = changed(noisy, lambda i, d: replace(d, covariance=None) if i == 2 else d)
    mixed = solved(some, weights="covariance")
    assert worst_px(mixed.camera, calibration.camera) < 1e-9
    assert any("1 of 8 views" in problem.message for problem in mixed.problems)


def test_outliers_of_corners_that_few_views_show_are_found_without_going_in_circles():
    rng = np.random.default_rng(4)
    few = changed(small_world(12, noise_px=0.1), lambda i, d: d.keeping((d.ids < 50) | (rng.random(len(d)) < 0.2)))
    observations, masks = spoilt(few, 0.02, 30.0)
    calibration = solved(observations, board_shape="free", robust=True)
    counts = np.bincount(np.concatenate([d.ids for d in observations.detections]), minlength=63)
    for found, planted, d in zip(calibration.outliers, masks, observations.detections, strict=True):
        clear = counts[d.ids] >= 4  # of two or three views of a corner, which one is wrong cannot always be told
        np.testing.assert_array_equal(found[clear], planted[clear])
    assert worst_px(demo_camera(), calibration.camera) < 1.0
