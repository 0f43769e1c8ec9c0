"""What every solver refuses before and after its engine runs, and how far a solution is from the minimum."""

from dataclasses import replace

import numpy as np
import pytest
from solver_worlds import SEED_BOARD, seed_world

from opencsp_calib.calibration import Calibration
from opencsp_calib.convergence import determined, remaining_sigmas
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.detection import Detection, Observations, View
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.free_board import laid_on_given, with_lone_corners
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.solving import check_request, finished
from opencsp_calib.unknowns import Estimate


class Engine:
    name = "engine"
    models = frozenset({"opencv4"})
    abilities = frozenset({"weights"})

    def missing(self):
        return None

    def version(self):
        return "1.0"

    def solve(self, observations, model, options):
        raise NotImplementedError


CAMERA, POSES, OBSERVATIONS = seed_world(4)
ROTATIONS = np.array([pose.rotation for pose in POSES])
TRANSLATIONS = np.array([pose.translation for pose in POSES])
ESTIMATE = Estimate(CAMERA.params, np.array([pose.matrix for pose in POSES]), TRANSLATIONS, SEED_BOARD.points)


def with_ids(ids):
    detection = OBSERVATIONS.detections[0]
    return replace(OBSERVATIONS.views[0], detection=detection.keeping(np.isin(detection.ids, ids)))


@pytest.mark.parametrize(
    ("model", "options", "said"),
    [
        ("opencv5", {}, "'engine' has no lens model 'opencv5'; it has opencv4"),
        ("kb8", {}, "no lens model is called 'kb8'"),
        ("opencv4", {"robust": True}, "cannot leave out outlying corners"),
        ("opencv4", {"board_shape": "free", "pixel_aspect": 1.0}, "shape or hold the pixel aspect"),
        ("opencv4", {"weights": "covariance"}, "without covariance"),
    ],
)
def test_what_the_solver_cannot_do_is_refused(model, options, said):
    with pytest.raises(InputError, match=said):
        check_request(Engine(), OBSERVATIONS, model, SolveOptions(**options))


@pytest.mark.parametrize(
    ("views", "said"),
    [
        ((), "0 usable view"),
        (OBSERVATIONS.views[:1], "1 usable view"),
        ((OBSERVATIONS.views[1], with_ids([0, 5, 40])), "view_001 has 3 corners"),
        ((OBSERVATIONS.views[1], with_ids(range(22))), "not all on one line"),
        ((with_ids([0, 21, 396, 417]), replace(with_ids([0, 21, 396, 417]), image="b")), "too few for the 20 unknowns"),
    ],
)
def test_what_nobody_can_solve_is_refused(views, said):
    with pytest.raises(InputError, match=said):
        check_request(Engine(), replace(OBSERVATIONS, views=tuple(views)), "opencv4", SolveOptions())


def test_what_can_be_solved_is_not_refused():
    check_request(Engine(), OBSERVATIONS, "opencv4", SolveOptions())


def ended(params=CAMERA.params, rotations=ROTATIONS, translations=TRANSLATIONS, model="opencv4", **more):
    return finished(Engine(), OBSERVATIONS, model, SolveOptions(), params, rotations, translations, **more)


def test_a_good_end():
    calibration = ended()
    assert calibration.rms_px < 1e-9
    assert calibration.solver == "engine 1.0"


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"params": np.full(8, np.nan)}, "found no solution"),
        ({"params": CAMERA.params * [-1, -1, 1, 1, 1, 1, 1, 1]}, "found no solution"),
        ({"rotations": ROTATIONS * np.inf}, "found no solution"),
        ({"params": CAMERA.params * [1, 1, 9, 1, 1, 1, 1, 1]}, "far outside of the image"),
        ({"translations": -TRANSLATIONS}, "418 of the corners of view_001 behind it"),
        ({"params": CAMERA.params * [1, 1, 1, 1, 50, 0, 1, 1]}, "folds back.*check the board"),
        (
            {"params": [*CAMERA.params[:4], -9, 0, 0, 0, 0, 0, 0, 0], "model": "opencv8"},
            "more coefficients than .* tell",
        ),
    ],
)
def test_what_cannot_be_true_fails(change, said):
    with np.errstate(invalid="ignore"), pytest.raises(CalibrationFailedError, match=said):
        ended(**change)


def test_an_outlier_may_be_out_of_sight():
    points = SEED_BOARD.points.copy()
    points[7] = [0.0, 0.0, -99.0]
    outliers = [detection.ids == 7 for detection in OBSERVATIONS.detections]
    board = SEED_BOARD.with_points(points)
    assert ended(board=board, outliers=outliers).rejected_corners == 4
    with pytest.raises(CalibrationFailedError):
        ended(board=board)


def exact(params):
    return Calibration(replace(CAMERA, params=params), OBSERVATIONS, POSES, SEED_BOARD, "", SolveOptions())


def test_remaining_sigmas_vanish_at_the_minimum_and_grow_with_the_distance():
    assert remaining_sigmas(exact(CAMERA.params)) < 1e-6
    one, two = (remaining_sigmas(exact(CAMERA.params + np.eye(8)[0] * step)) for step in (1e-4, 2e-4))
    assert one > 0
    assert two == pytest.approx(2.0 * one, rel=1e-3)


def test_remaining_sigmas_are_infinite_where_nothing_is_determined():
    head_on = tuple(Pose(np.zeros(3), np.array([-0.5, -0.4, 3.0])) for _ in range(4))
    views = [
        View(str(n), Detection(np.arange(418), CAMERA.project(pose.transform(SEED_BOARD.points))), "used")
        for n, pose in enumerate(head_on)
    ]
    seen = Observations(SEED_BOARD, CAMERA.image_size, tuple(views))
    pinhole = replace(CAMERA, model="pinhole", params=CAMERA.params[:4])
    calibration = Calibration(pinhole, seen, head_on, SEED_BOARD, "", SolveOptions())
    assert remaining_sigmas(calibration) > 1e3  # to rounding
    with pytest.raises(CalibrationFailedError, match="4 views do not determine the"):
        determined(calibration)


def test_a_solution_that_stops_short_is_said_to():
    assert determined(exact(CAMERA.params)).problems == ()
    short = determined(exact(CAMERA.params + np.eye(8)[0] * 0.3))
    assert [problem.code for problem in short.problems] == ["not-converged"]


def test_a_board_is_laid_on_the_given_one_and_shows_the_same():
    rng = np.random.default_rng(1)
    shape = SEED_BOARD.points + rng.normal(0.0, 1e-3, SEED_BOARD.points.shape)
    elsewhere = Pose(rng.normal(size=3), rng.normal(size=3))
    points = 7.0 * elsewhere.transform(shape)
    poses = [pose.after(elsewhere.inverse()) for pose in POSES]
    rotations = np.array([pose.matrix for pose in poses])
    translations = 7.0 * np.array([pose.translation for pose in poses])
    estimate = Estimate(CAMERA.params, rotations, translations, points)
    laid = laid_on_given(SEED_BOARD.points, estimate, np.arange(418))
    for pose, found in zip(POSES, laid.poses, strict=True):
        seen = CAMERA.project(found.transform(laid.points))
        np.testing.assert_allclose(seen, CAMERA.project(pose.transform(shape)), rtol=0, atol=1e-8)
    given = SEED_BOARD.points - SEED_BOARD.points.mean(axis=0)
    left = laid.points - SEED_BOARD.points
    np.testing.assert_allclose(left.sum(axis=0), 0.0, atol=1e-12)
    np.testing.assert_allclose(np.cross(given, left).sum(axis=0), 0.0, atol=1e-12)
    assert (given * left).sum() == pytest.approx(0.0, abs=1e-12)


def test_a_board_is_never_mirrored():
    mirrored = SEED_BOARD.points * [1.0, 1.0, -1.0]
    mirrored[:, 2] += 1e-3 * np.random.default_rng(0).normal(size=len(mirrored))
    laid = laid_on_given(SEED_BOARD.points, replace(ESTIMATE, points=mirrored), np.arange(418)).points
    before, after = (np.linalg.det(p[[1, 22, 200]] - p[0]) for p in (mirrored, laid))
    assert np.sign(before) == np.sign(after)


def test_corners_that_were_not_solved_for_are_where_they_were_given():
    moved = replace(ESTIMATE, points=SEED_BOARD.points + np.array([0.0, 0.0, 1e-3]))
    laid = laid_on_given(SEED_BOARD.points, moved, np.arange(1, 418)).points
    np.testing.assert_array_equal(laid[0], SEED_BOARD.points[0])
    np.testing.assert_allclose(laid[1:], SEED_BOARD.points[1:], atol=1e-12)


def test_a_lone_corner_lies_where_its_view_sees_it():
    detections = [OBSERVATIONS.detections[0], OBSERVATIONS.detections[1].keeping(np.arange(418) != 9)]
    given = SEED_BOARD.points + np.array([0.0, 0.0, 2e-3])
    estimate = replace(ESTIMATE, rotations=ESTIMATE.rotations[:2], translations=ESTIMATE.translations[:2], points=given)
    placed = with_lone_corners(CAMERA.lens, CornerTable.of(detections), estimate).points
    np.testing.assert_array_equal(np.delete(placed, 9, axis=0), np.delete(given, 9, axis=0))
    pixel = CAMERA.project(POSES[0].transform(placed[9:10]))
    np.testing.assert_allclose(pixel, detections[0].pixels[9:10], atol=1e-8)
    assert 0 < np.linalg.norm(placed[9] - given[9]) < 2e-3
