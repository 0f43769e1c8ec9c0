"""The conformance kit is tested with plugins that lie, one lie each: the check meant for the lie must catch it."""

import json
import threading
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from opencsp_calib_opencv.boards import CheckerboardKind
from opencsp_calib_opencv.checkerboard import CheckerboardDetector
from opencsp_calib_opencv.solver import OpenCVSolver

from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.conformance import checks_of, parametrize_checks
from opencsp_calib.detection import Detection
from opencsp_calib.errors import BoardSpecError, FileFormatError, InputError
from opencsp_calib.image import Image
from opencsp_calib.importing import as_imported
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose

ALL = frozenset({"guess", "board_warp", "board_free", "pixel_aspect", "weights", "robust"})


def caught(liar, check: str, **setup) -> str:
    """What the check says of the liar; fails where it says nothing."""
    found = {c.name: c for c in checks_of(liar, **setup)}[check]
    with pytest.raises(AssertionError) as said:
        found(liar)
    return str(said.value)


# --- solvers ---------------------------------------------------------------------------------------------------------


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
    def lie(self, calibration):
        return calibration

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


# --- detectors -------------------------------------------------------------------------------------------------------


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


# --- camera formats --------------------------------------------------------------------------------------------------


class Format:
    """A small format of JSON, and no lie: the image size, the model and the parameters of each camera."""

    name = "small"
    title = "A small format"
    extensions = (".small",)
    reads = writes = True
    models = ("opencv4", "opencv5")

    def missing(self):
        return None

    def recognises(self, path):
        try:
            return json.loads(path.read_text()).get("small") == 1
        except (OSError, ValueError, AttributeError):
            return False

    def read(self, path):
        try:
            cameras = json.loads(path.read_text())["cameras"]
            return {name: as_imported(name, m, self.came(np.array(p, float)), tuple(s)) for name, m, p, s in cameras}
        except (OSError, ValueError, TypeError, KeyError, IndexError, AttributeError, InputError) as error:
            raise FileFormatError(f"{path}: {' '.join(str(error).split())}") from None

    def write(self, cameras, path):
        if not cameras or any(camera.model not in self.models for camera in cameras.values()):
            raise InputError("cannot be written")
        cameras = [(n, c.model, list(self.went(c.params.copy())), c.image_size) for n, c in cameras.items()]
        path.write_text(json.dumps({"small": 1, "cameras": cameras}))

    def went(self, params):
        return params

    def came(self, params):
        return params


class CornerOrigin(Format):
    def went(self, params):
        return params + np.eye(len(params))[2:4].sum(axis=0) * 0.5


class SixDigits(Format):
    def went(self, params):
        return [float(f"{p:.5g}") for p in params]


class SwapsTangential(Format):
    def came(self, params):
        params[[6, 7]] = params[[7, 6]]
        return params


class DropsSize(Format):
    def read(self, path):
        return {
            name: replace(i, camera=replace(i.camera, image_size=(640, 480))) for name, i in super().read(path).items()
        }


class OtherProjection(Format):
    def read(self, path):
        def moved(imported):
            return replace(imported, project=lambda points: imported.camera.project(points) + 0.5)

        return {name: moved(imported) for name, imported in super().read(path).items()}


class RecognisesAll(Format):
    def recognises(self, path):
        return True


class RecognisesNothing(Format):
    def recognises(self, path):
        return False


class RecognisesRudely(Format):
    def recognises(self, path):
        return path.read_bytes().startswith(b'{"small": 1')


class ReadsRudely(Format):
    def read(self, path):
        text = json.loads(path.read_text())
        return {name: as_imported(name, m, np.array(p), tuple(s)) for name, m, p, s in text["cameras"]}


class WritesAnything(Format):
    def write(self, cameras, path):
        pinholes = {n: Camera(n, "opencv4", np.resize(c.params, 8), c.image_size) for n, c in cameras.items()}
        super().write(pinholes or {"none": Camera("none", "opencv4", np.ones(8), (1, 1))}, path)


class LeavesAHalf(Format):
    def write(self, cameras, path):
        path.write_text("{")
        super().write(cameras, path)


class LastOneWins(Format):
    def write(self, cameras, path):
        super().write(dict(list(cameras.items())[-1:]), path)


class BackToFront(Format):
    def read(self, path):
        return dict(reversed(super().read(path).items()))


class WithoutADot(Format):
    extensions = ("small",)


class DoesNothing(Format):
    reads = writes = False


FORMAT_LIES = [
    (CornerOrigin, "reads_what_it_writes"),
    (SixDigits, "reads_what_it_writes"),
    (SwapsTangential, "reads_what_it_writes"),
    (DropsSize, "reads_what_it_writes"),
    (OtherProjection, "reads_what_it_writes"),
    (RecognisesNothing, "reads_what_it_writes"),
    (RecognisesAll, "recognises_only_its_own"),
    (RecognisesRudely, "recognises_only_its_own"),
    (ReadsRudely, "refuses_damaged_files"),
    (WritesAnything, "refuses_what_it_does_not_carry"),
    (LeavesAHalf, "refuses_what_it_does_not_carry"),
    (LastOneWins, "keeps_cameras_apart"),
    (BackToFront, "keeps_cameras_apart"),
    (WithoutADot, "says_what_it_carries"),
    (DoesNothing, "says_what_it_carries"),
]


@pytest.mark.parametrize(("liar", "check"), FORMAT_LIES, ids=lambda value: getattr(value, "__name__", value))
def test_a_lying_format_is_caught(liar, check):
    assert caught(liar(), check)


class BothWaysWrong(CornerOrigin):
    """Half a pixel off when writing, and again, the other way, when reading: only another program's file shows it."""

    def came(self, params):
        return params - np.eye(len(params))[2:4].sum(axis=0) * 0.5


def test_half_a_pixel_wrong_both_ways_is_caught_by_a_sample(tmp_path: Path):
    truth = Camera("cam", "opencv4", np.array([700.0, 701.0, 320.0, 240.0, 0.1, 0.0, 0.0, 0.0]), (640, 480))
    Format().write({"cam": truth}, tmp_path / "theirs.small")
    samples = {tmp_path / "theirs.small": {"cam": truth}}
    for check in checks_of(BothWaysWrong()):
        check(BothWaysWrong())
    assert "half a pixel" in caught(BothWaysWrong(), "reads_other_programs_files", samples=samples)


@parametrize_checks(Format())
def test_without_a_lie_the_format_conforms(provided, check):
    check(provided)


# --- board kinds -----------------------------------------------------------------------------------------------------


class RowsFirst(CheckerboardKind):
    def parse(self, spec):
        board = super().parse(spec)
        return Checkerboard(board.rows, board.columns, board.spacing_m)


class Upwards(CheckerboardKind):
    def parse(self, spec):
        board = super().parse(spec)
        return board.with_points(board.points * [1.0, -1.0, 1.0])


class Lenient(CheckerboardKind):
    def parse(self, spec):
        return super().parse(":".join(spec.split(":")[:3]))


class ParsesRudely(CheckerboardKind):
    def parse(self, spec):
        columns, rows = map(int, spec.split(":")[1].split("x"))
        return super().parse(f"checkerboard:{columns}x{rows}:{spec.split(':')[2]}")


class Mute(CheckerboardKind):
    def parse(self, spec):
        try:
            return super().parse(spec)
        except BoardSpecError:
            raise BoardSpecError("no") from None


class DrawsElsewhere(CheckerboardKind):
    def draw(self, board):
        drawing = super().draw(board)
        return replace(drawing, origin_m=(1.1 * board.spacing_m, board.spacing_m))


class LightFirst(CheckerboardKind):
    def draw(self, board):
        return replace(super().draw(board), origin_m=(2 * board.spacing_m, board.spacing_m))


class OffThePage(CheckerboardKind):
    def draw(self, board):
        drawing = super().draw(board)
        return replace(drawing, width_m=0.9 * drawing.width_m)


BOARD_LIES = [
    (RowsFirst, "parses_its_own_descriptions"),
    (Upwards, "numbers_corners_row_by_row"),
    (Lenient, "refuses_what_it_cannot_understand"),
    (ParsesRudely, "refuses_what_it_cannot_understand"),
    (Mute, "refuses_what_it_cannot_understand"),
    (DrawsElsewhere, "draws_its_corners_where_they_are"),
    (LightFirst, "draws_its_corners_where_they_are"),
    (OffThePage, "draws_its_corners_where_they_are"),
]


@pytest.mark.parametrize(("liar", "check"), BOARD_LIES, ids=lambda value: getattr(value, "__name__", value))
def test_a_lying_board_kind_is_caught(liar, check):
    assert caught(liar(), check)


def test_a_board_kind_of_a_third_party_needs_its_own_descriptions():
    class Rings(CheckerboardKind):
        name, grammar = "rings", "rings:COLUMNSxROWS:SIZE"

    assert "specs=" in caught(Rings(), "parses_its_own_descriptions")


# --- image sources ---------------------------------------------------------------------------------------------------


class Source:
    """A device that counts, and no lie."""

    name = "counter"

    def __init__(self):
        self.lock = threading.Lock()

    def missing(self):
        return None

    def devices(self):
        return ["one"]

    @contextmanager
    def open(self, device, **settings):
        if device != "one":
            raise InputError(f"there is no device {device!r}")
        if not self.lock.acquire(blocking=False):
            raise InputError("the device is in use")
        try:
            yield self.images()
        finally:
            self.lock.release()

    def images(self):
        for number in range(5):
            yield Image(f"{number}.png", np.full((4, 6), number, dtype=np.uint8))


class OneBuffer(Source):
    def images(self):
        buffer = np.zeros((4, 6), dtype=np.uint8)
        for number in range(5):
            buffer[:] = number
            yield Image(f"{number}.png", buffer)


class OneName(Source):
    def images(self):
        return (replace(image, name="image.png") for image in super().images())


class Empty(Source):
    def images(self):
        return iter(())


class NeverLetsGo(Source):
    @contextmanager
    def open(self, device, **settings):
        if device != "one":
            raise InputError("no")
        if not self.lock.acquire(blocking=False):
            raise InputError("the device is in use")
        yield self.images()


class OpensAnything(Source):
    def open(self, device, **settings):
        return super().open("one", **settings)


class ListsTwice(Source):
    def devices(self):
        return ["one", "one"]


SOURCE_LIES = [
    (OneBuffer, "delivers_images"),
    (OneName, "delivers_images"),
    (Empty, "delivers_images"),
    (NeverLetsGo, "can_be_left_and_opened_again"),
    (OpensAnything, "refuses_an_unknown_device"),
    (ListsTwice, "lists_its_devices"),
]


@pytest.mark.parametrize(("liar", "check"), SOURCE_LIES, ids=lambda value: getattr(value, "__name__", value))
def test_a_lying_source_is_caught(liar, check):
    assert caught(liar(), check, device="one")


@parametrize_checks(Source(), device="one")
def test_without_a_lie_the_source_conforms(provided, check):
    check(provided)


# --- everything, and the kit itself ----------------------------------------------------------------------------------


class WithASpace(Source):
    name = "My Source"


class MissingALot(Source):
    def missing(self):
        return "this\nand that"


def test_names_and_what_is_missing():
    assert caught(WithASpace(), "has_a_name_that_can_be_typed")
    assert caught(MissingALot(), "says_what_is_missing")


def test_a_plugin_that_imports_its_vendor_is_caught(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    package = tmp_path / "greedy"
    package.mkdir()
    (package / "__init__.py").write_text("")
    (package / "vendor.py").write_text("try:\n    import cv2\nexcept ImportError:\n    pass\n")
    (package / "lazy.py").write_text(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import cv2\ndef f():\n    import cv2\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    liar = type("Greedy", (Source,), {"__module__": "greedy.solver"})()
    (package / "solver.py").write_text("from . import vendor\n")
    assert "cv2" in caught(liar, "loads_no_vendor_when_listed")
    honest = type("Lazy", (Source,), {"__module__": "greedy.lazy"})()
    {c.name: c for c in checks_of(honest)}["loads_no_vendor_when_listed"](honest)


def test_what_is_missing_something_is_skipped_and_only_where_it_must_run():
    class Absent(Source):
        def missing(self):
            return "pip install it"

    parameters = parametrize_checks(Absent()).mark.args[1]
    skipped = {p.values[1].name for p in parameters if any(mark.name == "skip" for mark in p.marks)}
    assert skipped == {
        "lists_its_devices",
        "refuses_an_unknown_device",
        "delivers_images",
        "can_be_left_and_opened_again",
    }


def test_a_known_failure_is_strict_and_must_name_a_check():
    parameters = parametrize_checks(Empty(), device="one", known_failures={"delivers_images": "it is empty"}).mark.args[
        1
    ]
    marked = {p.values[1].name: p.marks for p in parameters if p.marks}
    assert list(marked) == ["delivers_images"]
    (mark,) = marked["delivers_images"]
    assert (mark.name, mark.kwargs) == ("xfail", {"reason": "it is empty", "strict": True})
    with pytest.raises(InputError, match="no check is called delivers_image;"):
        parametrize_checks(Empty(), known_failures={"delivers_image": "a slip of the pen"})


def test_what_fulfils_no_contract_is_refused():
    with pytest.raises(InputError, match="Solver"):
        checks_of(object())
    assert isinstance(Checkerboard(3, 4, 0.1), Board)
