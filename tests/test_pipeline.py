"""The public functions: five lines as a plain script, stopping in the middle, dropping, and what is refused."""

import subprocess
import sys
import threading
import weakref
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from worlds import SmallWorld

import opencsp_calib
from opencsp_calib import (
    Calibration,
    Camera,
    Checkerboard,
    Detection,
    Image,
    InputError,
    Observations,
    Problem,
    calibrate,
    detect,
    solve,
)
from opencsp_calib.detecting import check_board_seen, look_at
from opencsp_calib.dropping import drop_above, drop_worst, excluding
from opencsp_calib.errors import CalibrationFailedError, CancelledError
from opencsp_calib.images import find_images
from opencsp_calib.judgement import judge
from opencsp_calib.looking import Search
from opencsp_calib.synthetic import demo_camera, observe, random_poses

SCRIPT = """
from opencsp_calib import Camera, Checkerboard, calibrate, compare, detect, solve
board = Checkerboard(columns=9, rows=6, spacing_m=0.03)
observations = detect("{folder}/*.png", board)
calibration = solve(observations, model="opencv4", solver="opencv")
calibration.camera.save("{out}"); camera = Camera.load("{out}")
pixels = camera.project([[0.0, 0.0, 1.0]])
print(compare(camera, camera).worst_px < 1e-9, camera.unproject(pixels)[0, 2] > 0.999)
print(observations.used[0].image, observations.detections[0].ids.shape, observations.detections[0].pixels.shape)
"""


def test_five_lines_work_as_a_plain_script(photographs: Path, tmp_path: Path) -> None:
    """Without a ``__main__`` guard: on any platform, whatever way processes are started there."""
    code = SCRIPT.format(folder=photographs.as_posix(), out=(tmp_path / "c.h5").as_posix())
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.split("\n")[:2] == ["True True", "01.png (54,) (54, 2)"]


def test_public_functions_are_functions_whatever_was_imported_before() -> None:
    import opencsp_calib.comparison
    import opencsp_calib.report

    for name in ("compare", "detect", "solve", "calibrate"):
        assert callable(getattr(opencsp_calib, name)), name


def test_detection_does_not_depend_on_how_many_work_at_it(small_world: SmallWorld, photographs: Path) -> None:
    alone, together = (detect(photographs, small_world.board, jobs=jobs) for jobs in (1, 3))
    for one, other in zip(alone.detections, together.detections, strict=True):
        np.testing.assert_array_equal(one.pixels, other.pixels)


def test_detection_can_be_stopped(small_world: SmallWorld, photographs: Path) -> None:
    stop = threading.Event()
    seen = []

    def progress(done: int, total: int, view: opencsp_calib.View) -> None:
        seen.append((done, total, view.image))
        stop.set()

    with pytest.raises(CancelledError, match="nothing was written"):
        detect(photographs, small_world.board, jobs=1, progress=progress, stop=stop)
    assert len(seen) < 12


def test_refinement_makes_corners_better(small_world: SmallWorld, photographs: Path) -> None:
    truth = small_world.camera.project(small_world.poses[0].transform(small_world.board.points))
    errors = {}
    for how in ("none", "subpix", "model"):
        found = detect(sorted(photographs.glob("*.png"))[:1], small_world.board, refine=how).detections[0]
        # a board's first corner may be at either end
        forwards, backwards = (np.linalg.norm(found.pixels - t[found.ids], axis=1) for t in (truth, truth[::-1]))
        errors[how] = min(np.sqrt((forwards**2).mean()), np.sqrt((backwards**2).mean()))
    assert errors["model"] < 0.02
    assert errors["model"] < 0.5 * errors["subpix"] < errors["none"]


def test_calibrate_is_detect_then_solve(small_world: SmallWorld, photographs: Path) -> None:
    whole = calibrate(photographs, small_world.board, solver="opencv", jobs=2)
    apart = solve(detect(photographs, small_world.board), solver="opencv")
    assert whole.camera == apart.camera
    assert set(whole.provenance["images"]) == {f"{n:02d}.png" for n in range(1, 13)}


def test_the_camera_comes_with_an_honest_sigma(small_world: SmallWorld) -> None:
    seen = observe(small_world.camera, small_world.board, small_world.poses, noise_px=0.1, rng=5)
    found = solve(seen, board_shape="flat")
    assert np.isfinite(found.sigma).all()
    against_residual = np.linalg.eigvals(np.linalg.solve(found.covariance_residual, found.covariance)).real
    assert against_residual.mean() >= 1 - 1e-9  # on the whole never below what the residuals alone would have
    assert (np.abs(found.camera.params - small_world.camera.params) < 6 * found.sigma).all()


@pytest.fixture(scope="module")
def seen() -> Observations:
    world = SmallWorld.seeded(8)
    return observe(world.camera, world.board, world.poses, noise_px=0.05, rng=2)


def quick(observations: Observations) -> Calibration:
    return solve(observations, solver="opencv")


def test_dropping(seen: Observations) -> None:
    first = quick(seen)
    without = drop_worst(first, 2, quick)
    worst = set(np.argsort(-first.view_rms_px)[:2])
    dropped = [index for index, view in enumerate(without.observations.views) if view.status == "dropped"]
    assert set(dropped) == worst
    assert "its rms was" in without.observations.views[dropped[0]].problems[-1].message
    assert drop_above(first, 100.0, quick) is first
    limit = float(np.sort(first.view_rms_px)[-2])
    left = {view.image for view in drop_above(first, limit, quick).observations.used}
    assert left <= {view.image for view in seen.views} - {seen.views[first.view_rms_px.argmax()].image}
    with pytest.raises(InputError, match="must be left"):
        drop_worst(first, 6, quick)
    with pytest.raises(InputError, match="must be left"):
        drop_above(first, 1e-6, quick)
    assert len(excluding(seen, ["view_001"]).used) == 7


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"solver": "opencv", "board_shape": "free"}, "bundle"),
        ({"solver": "mrcal", "model": "opencv14"}, "able"),
        ({"solver": "none"}, "installed are"),
        ({"model": "opencv9"}, "no lens model"),
        ({"pixel_aspect": -1.0}, "positive"),
        ({"weights": "covariances"}, "weights is one of equal, covariance, not 'covariances'"),
        ({"board_shape": "bent"}, "board_shape is one of flat, warp, free, not 'bent'"),
        ({"pixel_aspect": float("nan")}, "positive"),
    ],
)
def test_what_cannot_be_asked_is_refused(seen: Observations, options: dict, words: str) -> None:
    with pytest.raises(InputError, match=words):
        solve(seen, **options)


def test_where_a_guess_leads_nowhere_it_is_doubted_too(seen: Observations) -> None:
    guess = Camera("far off", "pinhole", [900.0, 900.0, 5000.0, 240.0], seen.image_size)
    with pytest.raises(CalibrationFailedError, match="it may also be the guess: try without it"):
        solve(seen, solver="opencv", guess=guess)


def test_the_same_view_again_and_again_is_refused(seen: Observations) -> None:
    same = tuple(replace(seen.views[0], image=f"{n}.png") for n in range(4))
    with pytest.raises(InputError, match="very same place"):
        solve(replace(seen, views=same))


def test_no_board_says_the_commonest_reason(tmp_path: Path, small_world: SmallWorld) -> None:
    nothing = tuple(
        replace(view, status="no board", detection=opencsp_calib.Detection.nothing("too dark"))
        for view in observe(small_world.camera, small_world.board, small_world.poses).views
    )
    with pytest.raises(InputError, match="in 12 images: too dark"):
        solve(Observations(Checkerboard(9, 6, 0.03), (640, 480), nothing))


def test_parts_of_a_smaller_board_are_not_taken_for_those_of_the_one_asked_for(small_world: SmallWorld) -> None:
    """Squares counted instead of corners: near the image's border, the smaller board may be part of the larger."""
    columns, rows = small_world.board.grid
    asked = Checkerboard(columns + 1, rows + 1, small_world.board.spacing_m)
    views = observe(small_world.camera, small_world.board, small_world.poses).views
    parts = Observations(asked, (640, 480), views)
    whole = Detection.nothing(f"has {columns}x{rows} inner corners", other_board=True)
    other = replace(views[0], image="whole.png", detection=whole, status="no board")
    problems = (Problem("other-board", whole.reason),)
    check_board_seen(parts)
    with pytest.raises(InputError, match="shows another board, and no image the whole of this one: has 9x6"):
        solve(replace(parts, views=(*views, replace(other, problems=problems))))
    check_board_seen(replace(parts, board=small_world.board, views=(*views, replace(other, problems=problems))))


class Counting:
    """A detector that finds nothing, and counts the images that are in memory while it looks."""

    name, feature = "counting", "own"

    def __init__(self) -> None:
        self.alive: weakref.WeakSet[Image] = weakref.WeakSet()
        self.most, self.looked = 0, 0

    def missing(self) -> None:
        return None

    def supports(self, board: opencsp_calib.Board) -> bool:
        return True

    def detect(self, image: Image, board: opencsp_calib.Board) -> Detection:
        self.alive.add(image)
        self.most = max(self.most, len(self.alive))
        self.looked += 1
        return Detection.nothing("not looked for")


def test_no_more_images_are_in_memory_than_are_looked_at(photographs: Path) -> None:
    detector = Counting()
    file = find_images(photographs)[0]
    files = [replace(file, name=f"{index}.png") for index in range(60)]
    found = look_at(files, Search(Checkerboard(9, 6, 0.03), detector, "none"), jobs=2)
    assert detector.looked == len(found.views) == 60
    assert detector.most <= 3  # one each, and one that is being handed over


def test_a_detector_of_ones_own_needs_no_plugin(photographs: Path) -> None:
    detector = Counting()
    found = detect(photographs, Checkerboard(9, 6, 0.03), detector=detector)
    assert detector.looked == len(found.views) == 12
    assert {view.status for view in found.views} == {"no board"}


def test_a_solver_that_cannot_hold_the_pixel_aspect_is_not_made_to() -> None:
    """All views the same way up: square pixels would be assumed, which COLMAP cannot; then the aspect stays open."""
    pytest.importorskip("pycolmap", reason="pip install 'opencsp-calib[colmap]'")
    board, camera = Checkerboard(9, 6, 0.1), demo_camera()
    poses = random_poses(board, camera, 12, 3, tilt_deg=(25, 45), roll_deg=(-5, 5), fill=(0.5, 0.9))
    seen = observe(camera, board, poses, noise_px=0.02, rng=3)
    found = solve(seen, solver="colmap", board_shape="free")
    assert found.options.pixel_aspect is None
    assert "one-orientation" in {problem.code for problem in judge(found)}
