"""Promises of a solver: what it finds is where the truth is, in our conventions, and nothing is passed over.

Where observations are exact the camera is found to `EXACT_PX`, which is also where `validate` says that two solvers
agree: engines that take pixels in single precision reach it, engines with another convention do not. Where a lens
model has terms that only the outermost corners tell apart, single precision (6e-5 px) leaves more, but not at corners.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from opencsp_calib.arrays import Floats, Ids
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.comparison import compare
from opencsp_calib.conformance.kit import Promise, Setup, promise
from opencsp_calib.conformance.worlds import BOARD, VIEWS, World, edited, main_model, world
from opencsp_calib.convergence import CONVERGED_SIGMAS, remaining_sigmas
from opencsp_calib.detection import Detection, Observations, View
from opencsp_calib.errors import CalibError, InputError
from opencsp_calib.interfaces import Solver
from opencsp_calib.models import LENS_MODELS
from opencsp_calib.options import SolveOptions
from opencsp_calib.solving import ABILITIES

__all__ = ["CHECKS", "EXACT_PX", "found", "model_checks"]

EXACT_PX = 1e-3
RICH_PX, RICH_COEFFICIENTS = 0.1, 6  # what is allowed in the image's corners from that many coefficients on
UNALIGNED_PX = 0.2  # the frames not aligned: a turn of the camera hides there, and half a pixel would be 0.5


def found(solver: Solver, seen: World, options: SolveOptions | None = None) -> Calibration:
    """What the solver makes of a world."""
    return solver.solve(seen.observations, seen.camera.model, options or SolveOptions())


def says_what_it_can_do(solver: Solver, setup: Setup) -> None:
    """Its models are lens models of ours, its abilities of the known ones, and it has a version."""
    strange = sorted(set(solver.models) - set(LENS_MODELS))
    promise(solver.models and not strange, f"its models must be some of {', '.join(LENS_MODELS)}, not {strange}")
    unknown = sorted(set(solver.abilities) - set(ABILITIES))
    promise(not unknown, f"unknown abilities {unknown}; there are {', '.join(ABILITIES)}")
    version = solver.version()
    promise(isinstance(version, str) and version.strip(), f"its version must be a text, not {version!r}")


def recovers(model: str, solver: Solver, setup: Setup) -> None:
    """From exact observations it finds the camera, and where the board was in every view."""
    exact = world(model)
    calibration = found(solver, exact)
    rich = len(exact.camera.distortion) >= RICH_COEFFICIENTS
    _promise_camera(calibration.camera, exact.camera, RICH_PX if rich else EXACT_PX)
    promise(calibration.rms_px < EXACT_PX, f"from exact pixels it leaves an rms of {calibration.rms_px:.3g} px")
    pixels = calibration.camera.project(exact.camera.unproject(_image_corners(exact.camera)))
    off = np.abs(pixels - _image_corners(exact.camera)).max()
    promise(off < UNALIGNED_PX, f"its camera is off by {off:.3g} px at the image's corners: is a pixel's centre at 0?")
    for view, (pose, truth) in enumerate(zip(calibration.cam_from_board, exact.poses, strict=True)):
        there, wanted = pose.transform(exact.board.points), truth.transform(exact.board.points)
        off = np.abs(there - wanted).max() / np.linalg.norm(wanted, axis=1).min()
        promise(off < 1e-4, f"view {view}: the board is off by {off:.2g} of its distance; poses map board to camera")


def residuals_are_predicted_minus_detected(solver: Solver, setup: Setup) -> None:
    """They are what its camera, its poses and its board predict, minus what was detected, to 1e-9 px."""
    noisy = world(main_model(solver), noise_px=0.3)
    calibration = found(solver, noisy)
    triples = zip(calibration.cam_from_board, noisy.observations.detections, calibration.residuals, strict=True)
    for view, (pose, detection, residuals) in enumerate(triples):
        points = pose.transform(calibration.board.points[detection.ids])
        off = np.abs(calibration.camera.project(points) - detection.pixels - residuals).max()
        promise(off < 1e-9, f"view {view}: its residuals are off by {off:.3g} px")


def reaches_the_minimum(solver: Solver, setup: Setup) -> None:
    """With noise, no step lowers the sum of squares by more than a hundredth of what noise makes likely."""
    noisy = world(main_model(solver), noise_px=0.1)
    remaining = remaining_sigmas(found(solver, noisy))
    promise(remaining < CONVERGED_SIGMAS, f"it stops {remaining:.2g} sigmas from the least sum of squares")


def keeps_order_and_number_of_views(solver: Solver, setup: Setup) -> None:
    """One pose a used view, in their order, whatever stands between them and however corners are ordered."""
    plain = world(main_model(solver))
    order = np.random.default_rng(3).permutation(VIEWS)
    used = [plain.observations.used[number] for number in order]
    others = (View("blurred.png", Detection.nothing("no board"), "no board"), replace(used[0], image="bad.png"))
    between = replace(others[1], status="dropped")
    shuffled = replace(plain.observations, views=(others[0], *used[:5], between, *used[5:]))
    seen = plain.seen_as(edited(shuffled, _some_corners))
    calibration = found(solver, seen)
    promise(len(calibration.cam_from_board) == VIEWS, f"{len(calibration.cam_from_board)} poses for {VIEWS} views")
    _promise_camera(calibration.camera, plain.camera, EXACT_PX)
    for number, pose in zip(order, calibration.cam_from_board, strict=True):
        off = np.abs(pose.translation - plain.poses[number].translation).max()
        promise(
            off < 1e-3, f"the pose of view {number} is off by {off:.3g} m: are poses in the order of the used views?"
        )
    _promise_same(calibration.observations, seen.observations)


def holds_the_board_as_given(solver: Solver, setup: Setup) -> None:
    """A measured board, neither flat nor even, is taken as it is and stays so."""
    measured = BOARD.with_points(BOARD.points + np.random.default_rng(5).normal(0.0, 3e-4, BOARD.points.shape))
    exact = world(main_model(solver), truth=measured)
    calibration = found(solver, exact)
    promise(np.array_equal(calibration.board.points, measured.points), "it changes a board that it was to hold")
    _promise_camera(calibration.camera, exact.camera, EXACT_PX)


def knows_no_unit(solver: Solver, setup: Setup) -> None:
    """A board and its distances a hundred times larger give the same camera."""
    small = world(main_model(solver), noise_px=0.1)
    board = replace(BOARD, spacing_m=100.0 * BOARD.spacing_m, points=100.0 * BOARD.points)
    large = small.seen_as(small.observations.with_board(board))
    one, other = found(solver, small), found(solver, large)
    _promise_camera(one.camera, other.camera, EXACT_PX)
    ratio = np.linalg.norm(other.cam_from_board[0].translation) / np.linalg.norm(one.cam_from_board[0].translation)
    promise(abs(ratio - 100.0) < 1e-2, f"a board 100 times larger is {ratio:.5g} times as far away")


def leaves_its_input_alone(solver: Solver, setup: Setup) -> None:
    """Observations are as before, and what it says of them and of itself is true."""
    noisy = world(main_model(solver), noise_px=0.1)
    before = [detection.pixels.copy() for detection in noisy.observations.detections]
    options = SolveOptions()
    calibration = found(solver, noisy, options)
    after = [detection.pixels for detection in noisy.observations.detections]
    promise(all(map(np.array_equal, before, after)), "it writes into the detections")
    _promise_same(calibration.observations, noisy.observations)
    promise(calibration.options == options, "the calibration does not hold the options that were asked for")
    label = f"{solver.name} {solver.version()}"
    promise(calibration.solver == label, f"the calibration is by {calibration.solver!r}, expected {label!r}")
    promise(calibration.camera.image_size == noisy.camera.image_size, "the camera has another image size")


def refuses_what_it_cannot_do(solver: Solver, setup: Setup) -> None:
    """A lens model or an option that it does not have is an InputError, not passed over."""
    plain = world(main_model(solver), noise_px=0.1)
    asked = {
        "guess": SolveOptions(guess=plain.camera),
        "board_warp": SolveOptions(board_shape="warp"),
        "board_free": SolveOptions(board_shape="free"),
        "pixel_aspect": SolveOptions(pixel_aspect=1.0),
        "weights": SolveOptions(weights="covariance"),
        "robust": SolveOptions(robust=True),
    }
    for ability in sorted(set(asked) - set(solver.abilities)):
        _promise_refused(solver, plain.observations, plain.camera.model, asked[ability], ability)
    for model in sorted(set(LENS_MODELS) - set(solver.models)):
        _promise_refused(solver, plain.observations, model, SolveOptions(), f"the lens model {model}")


def fails_with_a_clear_line(solver: Solver, setup: Setup) -> None:
    """What cannot be solved is a CalibError of one line; nothing else is ever raised."""
    plain = world(main_model(solver))
    views = plain.observations.views
    same = tuple(replace(views[0], image=f"{number}.png") for number in range(3))
    hopeless = {
        "no view": (),
        "one view": views[:1],
        "three corners a view": edited(plain.observations, lambda _, seen: _first(seen, 3)).views,
        "corners on one line": edited(plain.observations, lambda _, seen: _first(seen, BOARD.columns)).views,
        "all views head-on": world(plain.camera.model, tilt_deg=(0.0, 0.0)).observations.views,
        "nonsense": edited(plain.observations, _nonsense).views,
        "one view three times": same,
    }
    certain = ("no view", "one view", "three corners a view", "corners on one line", "all views head-on")
    for what, chosen in hopeless.items():
        try:
            calibration = solver.solve(replace(plain.observations, views=chosen), plain.camera.model, SolveOptions())
        except CalibError as error:
            promise(
                str(error).strip() and "\n" not in str(error), f"{what}: the message {str(error)!r} is not one line"
            )
        else:
            promise(what not in certain, f"{what}: it returns a calibration")
            promise(np.isfinite(calibration.camera.params).all(), f"{what}: it returns a camera with NaN")


def model_checks(solver: Solver) -> dict[str, Promise]:
    """A check for each of its lens models, by name."""
    return {f"recovers_{model}": partial(recovers, model) for model in sorted(solver.models)}


CHECKS = (
    residuals_are_predicted_minus_detected,
    reaches_the_minimum,
    keeps_order_and_number_of_views,
    holds_the_board_as_given,
    knows_no_unit,
    leaves_its_input_alone,
    refuses_what_it_cannot_do,
    fails_with_a_clear_line,
)


def _promise_camera(camera: Camera, truth: Camera, tolerance_px: float) -> None:
    difference = compare(truth, camera)
    promise(
        difference.missing == 0 and difference.worst_px <= tolerance_px,
        f"its camera differs by {difference.worst_px:.3g} px somewhere in the image, allowed are {tolerance_px:g} px",
    )


def _promise_same(kept: Observations, given: Observations) -> None:
    pairs = [(a.ids, b.ids, a.pixels, b.pixels) for a, b in zip(kept.detections, given.detections, strict=True)]
    same = all(np.array_equal(a, b) and np.array_equal(p, q) for a, b, p, q in pairs)
    promise(same and len(kept.views) == len(given.views), "the calibration holds other observations than it was given")


def _promise_refused(solver: Solver, observations: Observations, model: str, options: SolveOptions, what: str) -> None:
    try:
        solver.solve(observations, model, options)
    except InputError:
        return
    except Exception as error:
        raise AssertionError(f"asked for {what}, it raises {error!r}; it must be an InputError") from error
    raise AssertionError(f"asked for {what}, which it does not promise, it returns a calibration all the same")


def _image_corners(camera: Camera) -> Floats:
    width, height = camera.image_size
    return np.array([[0.0, 0.0], [width - 1.0, 0.0], [0.0, height - 1.0], [width - 1.0, height - 1.0]])


def _some_corners(number: int, seen: Detection) -> Detection:
    """Two thirds of the corners, in any order."""
    chosen: Ids = np.random.default_rng(number).permutation(len(seen))[: 2 * len(seen) // 3]
    return Detection(seen.ids[chosen], seen.pixels[chosen])


def _first(seen: Detection, count: int) -> Detection:
    return seen.keeping(np.asarray(seen.ids < count))


def _nonsense(number: int, seen: Detection) -> Detection:
    rng = np.random.default_rng(number)
    return replace(seen, pixels=rng.uniform(0.0, 900.0, seen.pixels.shape))
