"""Validation: solvers that agree, one that lies, one that breaks; models and boards of worlds whose truth is known."""

import json
from dataclasses import replace

import numpy as np
import pytest
from json_page import assert_as_documented
from opencsp_calib_bundle.solver import BundleSolver
from opencsp_calib_opencv.solver import OpenCVSolver

from opencsp_calib import Calibration, Camera, Checkerboard, Observations, Problem, SolveOptions
from opencsp_calib.synthetic import bowed, demo_camera, observe, seed_poses
from opencsp_calib.trials import supported, try_out
from opencsp_calib.uncertainty import with_uncertainty
from opencsp_calib.validate import Validation, validate

BOARD = Checkerboard(8, 5, 0.1)
CAMERA = demo_camera()


class Lying(BundleSolver):
    """Its focal length is half a pixel too long, as if it had stopped too early; and it says so."""

    name = "lying"

    def solve(self, observations: Observations, model: str, options: SolveOptions) -> Calibration:
        found = super().solve(observations, model, options)
        params = found.camera.params + np.r_[0.5, 0.5, np.zeros(len(found.camera.params) - 2)]
        stopped = Problem("not-converged", "lying ended short of the least sum of squares")
        return replace(found, camera=replace(found.camera, params=params)).with_problems(stopped)


class Broken(BundleSolver):
    """Fails as only a stranger's code does."""

    name = "broken"

    def solve(self, observations: Observations, model: str, options: SolveOptions) -> Calibration:
        raise RuntimeError("segmentation fault, nearly")


class Missing(BundleSolver):
    """Cannot run here."""

    name = "missing"

    def missing(self) -> str | None:
        return "apt install moonshine"


SOLVERS = {s.name: s for s in (BundleSolver(), OpenCVSolver(), Broken(), Missing())}


def world(camera: Camera = CAMERA, views: int = 12, bow_m: float = 0.0) -> Observations:
    poses = seed_poses(BOARD, camera, views, 1)
    return observe(camera, bowed(BOARD, bow_m), poses, noise_px=0.05, rng=2, nominal=BOARD)


def solved(observations: Observations, model: str = "opencv4", **options: object) -> Calibration:
    return with_uncertainty(BundleSolver().solve(observations, model, SolveOptions(**options)))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def validation() -> Validation:
    """Of a bent board whose shape is solved for, with one corner that is an outlier."""
    seen = world(bow_m=0.0015)
    view = seen.views[0]
    pixels = view.detection.pixels.copy()
    pixels[3] += 40
    spoiled = replace(view, detection=replace(view.detection, pixels=pixels))
    seen = replace(seen, views=(spoiled, *seen.views[1:]))
    calibration = solved(seen, board_shape="free", robust=True)
    assert calibration.rejected_corners == 1
    return validate(calibration, SOLVERS, models=("pinhole", "opencv4", "opencv5"))


def test_solvers_agree_on_the_board_as_solved(validation: Validation) -> None:
    assert [result.name for result in validation.solvers] == ["bundle", "opencv"]
    (pair,) = validation.pairs
    assert pair.agree
    assert pair.difference.worst_px < 2e-4
    assert validation.verdict == "agree"
    for result in validation.solvers:
        assert result.calibration.rms_px == pytest.approx(
            0.05 * np.sqrt(2), rel=0.1
        )  # the bent board is held, not flat
        assert sum(map(len, result.calibration.observations.detections)) == 12 * 40 - 1  # and the outlier is out


def test_what_cannot_run_is_a_line_and_no_crash(validation: Validation) -> None:
    text = "\n".join(validation.reasons)
    assert "the solver broken was left out: segmentation fault, nearly" in text
    assert "the solver missing was left out: apt install moonshine" in text


def test_halves_and_held_out_views_of_the_calibration_as_it_was_made(validation: Validation) -> None:
    own = validation.trials.own
    assert own is not None
    assert own.board_shape == "free"
    assert own.halves.difference.median_px < 5 * validation.predicted_px
    assert own.held_out.rms_px < 1.4 * 0.05 * np.sqrt(2)
    assert "nearly blind" in " ".join(validation.reasons)


def test_both_ways_to_take_the_board_are_shown(validation: Validation) -> None:
    own, other = validation.trials.own, validation.trials.other_board
    assert own is not None
    assert other is not None
    assert (own.board_shape, other.board_shape) == ("free", "flat")
    assert other.held_out.rms_px > 3 * own.held_out.rms_px
    assert any("solving for the board's shape moves the camera" in reason for reason in validation.reasons)


def test_json_is_as_documented(validation: Validation) -> None:
    found = json.loads(json.dumps(validation.as_json(), allow_nan=False))
    assert_as_documented("validate", found)
    assert list(found["solvers"]["bundle"]["params"]) == list(CAMERA.lens.parameter_names)
    assert sum(model["supported"] for model in found["models"]) == 1


def test_the_true_lens_model_is_the_one_the_data_support(validation: Validation) -> None:
    assert [trial.model for trial in validation.trials.models] == ["pinhole", "opencv4", "opencv5"]
    assert [trial.model for trial in validation.trials.models if trial.supported] == ["opencv4"]
    assert validation.trials.models[2].calibration.rms_px <= validation.trials.models[1].calibration.rms_px
    assert validation.trials.models[2].signs  # rms prefers the richest; the signs do not


@pytest.mark.parametrize("name", ["pinhole", "opencv5"])
def test_a_lens_poorer_or_richer_is_told_too(name: str) -> None:
    params = {
        "pinhole": [2700.0, 2700, 820, 610],
        "opencv5": [1500.0, 1500, 820, 610, -0.3, 0.15, 1e-3, -1e-3, -0.08],
    }
    camera = Camera("true", name, np.array(params[name]), (1626, 1236))
    seen = world(camera, views=14)
    models = ("pinhole", "opencv4", "opencv5")
    trials = [try_out(seen, model, SolveOptions(), BundleSolver(), aspect_given=True) for model in models]
    assert [trial.model for trial in supported(trials) if trial.supported] == [name]


def test_a_model_that_cannot_be_solved_for_is_a_line() -> None:
    found = validate(solved(world(views=4)), {"bundle": BundleSolver()}, models=("opencv4", "opencv14"))
    assert any(reason.startswith("opencv14 (flat board) could not be tried out:") for reason in found.reasons)


def test_a_solver_that_lies_is_found_out() -> None:
    found = validate(solved(world()), {**SOLVERS, "lying": Lying()}, models=())
    assert found.verdict == "disagree"
    assert [(pair.a, pair.b, pair.agree) for pair in found.pairs] == [
        ("bundle", "lying", False),
        ("bundle", "opencv", True),
        ("lying", "opencv", False),
    ]
    assert "bundle and lying differ by up to" in found.reasons[0]
    assert "lying ended short of the least sum of squares" in found.reasons


def test_one_solver_has_nobody_to_agree_with_and_it_is_said() -> None:
    found = validate(solved(world()), {"bundle": BundleSolver()}, models=())
    assert found.verdict == "not compared"
    assert "install another solver" in found.reasons[0]
    assert [trial.model for trial in found.trials.models] == ["opencv4"]  # the own model is always tried


def test_a_solver_that_can_do_less_does_what_it_can_and_it_is_said() -> None:
    calibration = solved(world(bow_m=0.0015), board_shape="free", weights="covariance")
    found = validate(calibration, {"opencv": OpenCVSolver()}, models=())
    assert "no solver here can do all that bundle did; opencv with the board as solved" in " ".join(found.reasons)
    assert found.trials.own is not None
    assert found.trials.own.held_out.rms_px < 1.2 * 0.05 * np.sqrt(2)  # it does hold the board as solved


def test_without_any_solver_there_is_still_an_answer() -> None:
    found = validate(solved(world()), {"missing": Missing()}, models=())
    assert found.trials.own is None
    assert found.as_json()["halves"] == {"median_px": None, "worst_px": None, "predicted_px": None}
    assert json.dumps(found.as_json(), allow_nan=False)


def test_three_views_have_no_halves_and_it_is_said() -> None:
    found = validate(solved(world(views=3)), {"bundle": BundleSolver()}, models=())
    assert found.trials.own is None
    assert "halves" in " ".join(found.reasons)
