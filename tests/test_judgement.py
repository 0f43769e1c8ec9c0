"""What is said about a calibration: each warning where the world gives cause for it, and silence where not."""

from dataclasses import replace

import numpy as np
import pytest
from worlds import SmallWorld

from opencsp_calib import Calibration, Camera, Checkerboard, Observations, Pose, Problem, SolveOptions
from opencsp_calib.judgement import fold_inside, judge, verdict
from opencsp_calib.quality import correlations, coverage, set_quality, view_qualities
from opencsp_calib.synthetic import observe, pose_in_view

WORLD = SmallWorld.seeded(30)
SIGMA = np.array([0.3, 0.3, 0.4, 0.4, 1e-3, 1e-3, 1e-4, 1e-4])


def result(poses: tuple[Pose, ...], noise_px: float = 0.05, camera: Camera = WORLD.camera) -> Calibration:
    """The truth, as if it had been solved for."""
    seen: Observations = observe(WORLD.camera, WORLD.board, poses, noise_px=noise_px, rng=3)
    return Calibration(camera, seen, poses, WORLD.board, "truth 0", SolveOptions(), covariance=np.diag(SIGMA**2))


def codes(calibration: Calibration) -> set[str]:
    return {problem.code for problem in judge(calibration)}


def tilted(tilt_deg: float, roll_deg: float, fill: float, place: tuple[float, float] = (0.5, 0.5)) -> Pose:
    tilt, roll = np.radians([tilt_deg, roll_deg])
    about_y = np.array([[np.cos(tilt), 0, np.sin(tilt)], [0, 1, 0], [-np.sin(tilt), 0, np.cos(tilt)]])
    about_z = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    return pose_in_view(WORLD.board, WORLD.camera, about_y @ about_z, fill, place)


def test_the_seeds_procedure_gives_no_cause() -> None:
    good = result(WORLD.poses)
    assert codes(good) == set()
    assert verdict(good).level == "good"


def test_views_are_measured_as_they_were_made() -> None:
    poses = tuple(tilted(tilt, roll, 0.7) for tilt, roll in ((0, 0), (35, 90), (45, 180), (20, 10)))
    views = view_qualities(result(poses))
    np.testing.assert_allclose([view.tilt_deg for view in views], [0, 35, 45, 20], atol=1e-6)
    assert [view.orientation for view in views] == ["horizontal", "vertical", "horizontal", "horizontal"]
    whole = set_quality(result(poses))
    assert (whole.views, whole.horizontal, whole.vertical) == (4, 3, 1)
    middle = WORLD.board.points.mean(axis=0)
    assert views[1].range_m == pytest.approx(np.linalg.norm(poses[1].transform(middle[None])))


def test_area_and_coverage_are_those_of_the_corners_outline() -> None:
    head_on = result((tilted(0, 0, 0.9),))
    width, height = np.ptp(head_on.observations.detections[0].pixels, axis=0)
    share = width * height / (640 * 480)
    assert view_qualities(head_on)[0].area == pytest.approx(share, rel=0.02)
    assert coverage(head_on.observations) == pytest.approx(share, abs=0.04)


def test_head_on_views_do_not_determine_the_focal_length() -> None:
    bad = result(tuple(tilted(t, 0, f) for t, f in ((0, 0.9), (3, 0.7), (6, 0.8))))
    assert {"head-on", "few-views", "one-orientation"} <= codes(bad)
    assert verdict(bad).level == "bad"
    assert "30 to 45 degrees" in verdict(bad).sentence


def test_parallel_boards_do_not_determine_the_camera_however_tilted() -> None:
    same = result(tuple(tilted(35, roll, 0.5, place) for roll, place in ((0, (0.4, 0.5)), (90, (0.6, 0.4)))))
    assert "parallel" in codes(same)
    assert "head-on" not in codes(same)
    assert verdict(same).level == "bad"
    assert "parallel" not in codes(result((tilted(35, 0, 0.5), tilted(20, 0, 0.5))))


def test_that_the_board_was_never_turned_is_said_once() -> None:
    upright = result(tuple(tilted(tilt, 0, 0.7) for tilt in (30, -35, 40)))
    assert "one-orientation" in codes(upright)
    for code in ("square-pixels-assumed", "pixel-aspect-open"):
        assert "one-orientation" not in codes(upright.with_problems(Problem(code, "no view is turned")))


def test_views_at_one_range_and_small_ones_are_said() -> None:
    same = result(tuple(tilted(35, roll, 0.4) for roll in (0, 5, 90)))
    assert "low-coverage" in codes(same)
    assert "one-range" not in codes(result(WORLD.poses))
    assert "one-range" in codes(result((tilted(35, 0, 0.6), tilted(35, 180, 0.6))))


def test_a_large_rms_names_the_views() -> None:
    bad = result(WORLD.poses, noise_px=1.2)
    assert {"poor-rms", "poor-view"} <= codes(bad)
    (poor,) = (problem.message for problem in judge(bad) if problem.code == "poor-view")
    worst = np.argsort(-bad.view_rms_px)
    assert poor.startswith(bad.observations.used[worst[0]].image)
    assert f" and {(bad.view_rms_px > 1).sum() - 5} more have an rms over 1.0 px" in poor
    assert verdict(bad).level == "bad"
    assert "a lens model with distortion" not in verdict(bad).sentence
    pinhole = Camera("c", "pinhole", WORLD.camera.params[:4] * 1.01, WORLD.camera.image_size)
    assert (
        "a lens model with distortion"
        in verdict(replace(bad, camera=pinhole, residuals=None, covariance=None, covariance_residual=None)).sentence
    )


def test_unequal_focal_lengths_are_said_only_beyond_their_sigmas() -> None:
    off = WORLD.camera.params.copy()
    off[0] += 3.0
    assert "fx-fy-differ" in codes(result(WORLD.poses, camera=replace(WORLD.camera, params=off)))
    off[0] -= 2.5
    assert "fx-fy-differ" not in codes(result(WORLD.poses, camera=replace(WORLD.camera, params=off)))
    held = replace(
        result(WORLD.poses, camera=replace(WORLD.camera, params=off + 3.0)), options=SolveOptions(pixel_aspect=1.1)
    )
    assert "fx-fy-differ" not in codes(held)
    certain = {"covariance": np.diag(SIGMA**2) * 1e-8}
    for ratio, said in ((1.00002, True), (1.000009, False)):  # a hundredth of a thousandth matters to nobody
        off[0] = ratio * off[1]
        camera = replace(WORLD.camera, params=off)
        assert ("fx-fy-differ" in codes(replace(result(WORLD.poses, camera=camera), **certain))) == said


def test_distortion_that_folds_inside_the_image_is_bad() -> None:
    folding = Camera("f", "opencv4", [400, 400, 320, 240, -0.6, 0, 0, 0], (640, 480))
    problem = fold_inside(folding)
    assert problem is not None
    assert problem.code == "fold-inside"
    assert fold_inside(WORLD.camera) is None


def test_correlations_are_those_of_the_covariance() -> None:
    given = np.eye(8)
    given[0, 1] = given[1, 0] = 0.75
    known = replace(result(WORLD.poses), covariance=given * np.outer(SIGMA, SIGMA))
    np.testing.assert_allclose(correlations(known), given, atol=1e-12)
    unknown = replace(result(WORLD.poses), covariance=None)
    assert np.isnan(correlations(unknown)).all()


def test_corners_on_a_line_cover_nothing() -> None:
    seen = result(WORLD.poses[:1]).observations
    line = seen.views[0].detection.keeping(np.arange(54) < 9)
    exact = replace(line, pixels=np.column_stack([np.arange(9.0), np.zeros(9)]))
    flat = Observations(Checkerboard(9, 6, 0.03), (640, 480), (replace(seen.views[0], detection=exact),))
    assert coverage(flat) == 0.0
