"""Solvers that lie, one lie each: the check meant for the lie must catch it."""

from dataclasses import replace

import numpy as np
import pytest
from lies import caught
from opencsp_calib_opencv.solver import OpenCVSolver

from opencsp_calib.conformance import parametrize_checks
from opencsp_calib.errors import InputError
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose

ALL = frozenset({"guess", "board_warp", "board_free", "pixel_aspect", "weights", "robust"})


class Solver(OpenCVSolver):
    """OpenCV's, and one lie."""

    name = "liar"
    models = frozenset({"opencv4"})

    def solve(self, observations, model, options):
        return self.lie(super().solve(observations, model, options))

    def lie(self, calibration):
        return calibration


def with_params(calibration, change):
    camera = replace(calibration.camera, params=change(calibration.camera.params.copy()))
    return replace(calibration, camera=camera, residuals=None)


class HalfAPixel(Solver):
    def lie(self, calibration):
        return with_params(calibration, lambda p: p + np.array([0, 0, 0.5, 0.5, 0, 0, 0, 0]))


class TangentialSwapped(Solver):
    def lie(self, calibration):
        return with_params(calibration, lambda p: p[[0, 1, 2, 3, 4, 5, 7, 6]])


class AspectSwapped(Solver):
    def lie(self, calibration):
        return with_params(calibration, lambda p: p[[1, 0, 2, 3, 4, 5, 6, 7]])


class PosesInverted(Solver):
    def lie(self, calibration):
        poses = tuple(pose.inverse() for pose in calibration.cam_from_board)
        return replace(calibration, cam_from_board=poses)


class InSquares(Solver):
    def lie(self, calibration):
        poses = tuple(Pose(p.rotation, p.translation / 0.03) for p in calibration.cam_from_board)
        return replace(calibration, cam_from_board=poses)


class Mirrored(Solver):
    def lie(self, calibration):
        return replace(calibration, cam_from_board=calibration.cam_from_board[::-1])


class SignWrong(Solver):
    def lie(self, calibration):
        return replace(calibration, residuals=tuple(-r for r in calibration.residuals))


class PerAxis(Solver):
    """Its residuals are divided by sqrt 2, so that its rms is per axis."""

    def lie(self, calibration):
        return replace(calibration, residuals=tuple(r / np.sqrt(2) for r in calibration.residuals))


class StopsShort(Solver):
    def solve(self, observations, model, options):
        calibration = super().solve(observations, model, options)
        return with_params(calibration, lambda p: p + np.array([0.3, 0, 0, 0, 0, 0, 0, 0]))


class NeverStarts(Solver):
    def solve(self, observations, model, options):
        camera = initial_camera(observations, model, options.guess)
        calibration = super().solve(observations, model, SolveOptions())
        return replace(calibration, camera=camera, cam_from_board=initial_poses(camera, observations), residuals=None)


class SkipsAView(Solver):
    def solve(self, observations, model, options):
        return super().solve(observations.dropping([observations.used[0].image]), model, options)


class SortedByName(Solver):
    def solve(self, observations, model, options):
        views = tuple(sorted(observations.views, key=lambda view: view.image))
        calibration = super().solve(replace(observations, views=views), model, options)
        return replace(calibration, observations=observations)


class InOrderOfCorners(Solver):
    """It takes every view's corners for the first of the board, in order."""

    def solve(self, observations, model, options):
        def ordered(view):
            return replace(view, detection=replace(view.detection, ids=np.arange(len(view.detection))))

        views = tuple(map(ordered, observations.views))
        calibration = super().solve(replace(observations, views=views), model, options)
        return replace(calibration, observations=observations)


class EveryBoardIsEven(Solver):
    def solve(self, observations, model, options):
        board = observations.board
        even = observations.with_board(board.with_points(board.nominal_points))
        return replace(super().solve(even, model, options), observations=observations, board=board)


class ReturnsNominalBoard(Solver):
    def lie(self, calibration):
        board = calibration.board
        return replace(calibration, board=board.with_points(board.nominal_points))


class ThinksInMetres(Solver):
    def lie(self, calibration):
        pull = min(calibration.board.spacing_m, 1.0)
        return with_params(calibration, lambda p: p + np.array([pull, pull, 0, 0, 0, 0, 0, 0]))


class RoundsPixels(Solver):
    def lie(self, calibration):
        def rounded(view):
            return replace(view, detection=replace(view.detection, pixels=np.round(view.detection.pixels, 2)))

        observations = calibration.observations
        return replace(calibration, observations=replace(observations, views=tuple(map(rounded, observations.views))))


class ForgetsOptions(Solver):
    def lie(self, calibration):
        return replace(calibration, options=SolveOptions(robust=True))


class UnderAnotherName(Solver):
    def lie(self, calibration):
        return replace(calibration, solver="ceres 2.2")


class PassesOver(Solver):
    def solve(self, observations, model, options):
        return super().solve(observations, "opencv4", SolveOptions(guess=options.guess))


class RefusesRudely(Solver):
    def solve(self, observations, model, options):
        if options.asked - self.abilities:
            raise NotImplementedError
        return super().solve(observations, model, options)


class Claims(Solver):
    """It has every ability, and does none of it."""

    abilities = ALL

    def solve(self, observations, model, options):
        return replace(OpenCVSolver().solve(observations, model, SolveOptions()), options=options)


class MarksEverything(Claims):
    def solve(self, observations, model, options):
        calibration = super().solve(observations, model, options)
        return replace(calibration, outliers=tuple(np.arange(len(r)) % 3 == 1 for r in calibration.residuals))


class Crashes(Solver):
    def solve(self, observations, model, options):
        if len(observations.used) < 2:
            raise IndexError
        return super().solve(observations, model, options)


class Cheerful(Solver):
    def solve(self, observations, model, options):
        from opencsp_calib.conformance.worlds import world

        known = world("opencv4")
        try:
            return super().solve(observations, model, options)
        except InputError:
            return super().solve(known.observations, model, options)


class KnowsNoModel(Solver):
    models = frozenset({"opencv4", "division"})


class HasASecret(Solver):
    abilities = frozenset({"guess", "telepathy"})


SOLVER_LIES = [
    (HalfAPixel, "recovers_opencv4"),
    (TangentialSwapped, "recovers_opencv4"),
    (AspectSwapped, "recovers_opencv4"),
    (PosesInverted, "recovers_opencv4"),
    (InSquares, "recovers_opencv4"),
    (Mirrored, "recovers_opencv4"),
    (SignWrong, "residuals_are_predicted_minus_detected"),
    (PerAxis, "residuals_are_predicted_minus_detected"),
    (StopsShort, "reaches_the_minimum"),
    (NeverStarts, "reaches_the_minimum"),
    (NeverStarts, "starts_from_a_guess"),
    (SkipsAView, "keeps_order_and_number_of_views"),
    (SortedByName, "keeps_order_and_number_of_views"),
    (InOrderOfCorners, "keeps_order_and_number_of_views"),
    (EveryBoardIsEven, "holds_the_board_as_given"),
    (ReturnsNominalBoard, "holds_the_board_as_given"),
    (ThinksInMetres, "knows_no_unit"),
    (RoundsPixels, "leaves_its_input_alone"),
    (ForgetsOptions, "leaves_its_input_alone"),
    (UnderAnotherName, "leaves_its_input_alone"),
    (PassesOver, "refuses_what_it_cannot_do"),
    (RefusesRudely, "refuses_what_it_cannot_do"),
    (Claims, "holds_the_pixel_aspect"),
    (Claims, "weighs_corners_by_their_covariance"),
    (Claims, "leaves_out_outliers"),
    (MarksEverything, "leaves_out_outliers"),
    (Claims, "finds_a_warp"),
    (Claims, "finds_the_shape"),
    (Crashes, "fails_with_a_clear_line"),
    (Cheerful, "fails_with_a_clear_line"),
    (KnowsNoModel, "says_what_it_can_do"),
    (HasASecret, "says_what_it_can_do"),
]


@pytest.mark.parametrize(("liar", "check"), SOLVER_LIES, ids=[f"{lie.__name__}-{check}" for lie, check in SOLVER_LIES])
def test_a_lying_solver_is_caught(liar, check):
    assert caught(liar(), check)


@parametrize_checks(Solver())
def test_without_a_lie_the_solver_conforms(provided, check):
    check(provided)
