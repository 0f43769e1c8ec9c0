"""Corners fitted in rendered photographs, where OpenCV's projection says where they are, and in what shows none."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from scipy.spatial.transform import Rotation

from opencsp_calib import Board, Camera, Checkerboard, Detection, Image, InputError, Pose, compiled
from opencsp_calib.arrays import Floats
from opencsp_calib.corner_grid import bends, displaced, edges
from opencsp_calib.corners import refine
from opencsp_calib.registry import installed
from opencsp_calib.rendering import Exposure, Scene, Spot, render

BOARD = Checkerboard(11, 8, 0.03)
SIZE = (480, 360)


@dataclass(frozen=True)
class View:
    """A photograph, and where its corners are."""

    image: Image
    board: Board
    truth: Floats

    def found(self, off_px: float = 0.5, seed: int = 0) -> Detection:
        """Every corner, off by so much in random directions."""
        angles = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(self.truth))
        off = off_px * np.column_stack([np.cos(angles), np.sin(angles)])
        return Detection(np.arange(len(self.truth)), self.truth + off)

    def errors(self, detection: Detection) -> Floats:
        return detection.pixels - self.truth[detection.ids]

    def squared_over_stated(self, detection: Detection) -> Floats:
        """(n,) squared error over covariance, 1 on average where the covariance is honest."""
        assert detection.covariance is not None
        errors = self.errors(detection)
        return np.einsum("ni,nij,nj->n", errors, np.linalg.inv(detection.covariance), errors) / 2


def view(
    square_px: float = 28.0,
    tilt_deg: float = 35.0,
    seed: int = 0,
    *,
    board: Board = BOARD,
    size: tuple[int, int] = SIZE,
    focal_px: float = 700.0,
    k1: float = -0.2,
    middle: tuple[float, float] = (0.5, 0.5),
    scene: Scene | None = None,
    exposure: Exposure | None = None,
) -> View:
    """A board whose squares are about as large as asked, tilted in a direction and rolled as the seed has it."""
    rng = np.random.default_rng(seed)
    azimuth, roll = rng.uniform(0, 2 * np.pi), rng.uniform(-0.6, 0.6)
    tilt = Rotation.from_rotvec(np.radians(tilt_deg) * np.array([np.cos(azimuth), np.sin(azimuth), 0]))
    turn = tilt * Rotation.from_rotvec([0, 0, roll])
    params = [focal_px, focal_px, size[0] / 2 + 3.2, size[1] / 2 - 2.7, k1, 0.05, 5e-4, -5e-4]
    camera = Camera("test", "opencv4", params, size)
    distance = focal_px * board.spacing_m / square_px
    off_px = (np.array(middle) - 0.5) * size + rng.uniform(-0.5, 0.5, 2)
    ray = np.array([*off_px / focal_px, 1.0])
    centre = board.points.mean(axis=0)
    pose = Pose(turn.as_rotvec(), distance * ray - turn.apply(centre))
    drawing = installed().boards[board.kind].draw(board)
    image = render(camera, board, pose, drawing=drawing, scene=scene, exposure=exposure, rng=seed)
    truth = cv2.projectPoints(board.points, pose.rotation, pose.translation, camera.matrix, camera.distortion)[0]
    return View(image, board, truth.reshape(-1, 2))


def rms(errors: Floats) -> float:
    """Per axis."""
    return float(np.sqrt(np.mean(errors**2)))


EXPOSURES = {
    "sharp": Exposure(psf_px=0.3),
    "usual": Exposure(),
    "soft": Exposure(psf_px=1.5),
    "defocused": Exposure(psf_px=0.4, defocus_px=3.0),
    "moved": Exposure(motion_px=(2.0, 1.0)),
    "noisy": Exposure(noise=8.0),
    "16 bits": Exposure(bits=16),
}


@pytest.mark.parametrize("name", EXPOSURES)
def test_corners_are_found_at_the_noise_limit_and_say_how_well(name: str) -> None:
    ratios, square_errors, limits, biases = [], [], [], []
    for seed in range(3):
        seen = view(seed=seed, exposure=EXPOSURES[name])
        refined = refine(seen.image, seen.found(), seen.board)
        assert len(refined) == len(seen.truth), refined.reason
        assert refined.covariance is not None
        ratios.append(seen.squared_over_stated(refined).mean())
        square_errors.append(np.mean(seen.errors(refined) ** 2))
        limits.append(np.trace(refined.covariance, axis1=1, axis2=2).mean() / 2)
        biases.append(seen.errors(refined).mean(axis=0))
    # 528 numbers: their mean square varies by 6 %, and what the psf leaves is not Gaussian
    assert 0.6 < np.mean(ratios) < 1.4
    assert np.mean(square_errors) < 1.5 * np.mean(limits)
    assert np.abs(np.mean(biases, axis=0)).max() < 4 * np.sqrt(np.mean(limits) / 264)


def test_a_hundredth_of_a_pixel_where_cornersubpix_has_several() -> None:
    seen = view(seed=5)
    start = seen.found()
    ours = rms(seen.errors(refine(seen.image, start, seen.board)))
    grey = seen.image.pixels.astype(np.float32)
    until = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_COUNT, 40, 0.001)
    theirs = cv2.cornerSubPix(grey, start.pixels.astype(np.float32), (5, 5), (-1, -1), until)
    assert ours < 0.006
    assert ours < rms(theirs - seen.truth) / 4


@pytest.mark.parametrize(("square_px", "psf_px", "limit_px"), [(8, 0.6, 0.012), (10, 1.0, 0.016), (14, 0.6, 0.008)])
def test_small_squares(square_px: float, psf_px: float, limit_px: float) -> None:
    seen = view(square_px, size=(200, 160), focal_px=300.0, exposure=Exposure(psf_px=psf_px))
    refined = refine(seen.image, seen.found(), seen.board)
    assert len(refined) == len(seen.truth), refined.reason
    assert rms(seen.errors(refined)) < limit_px


@pytest.mark.parametrize(("square_px", "psf_px"), [(16, 3.0), (24, 3.0), (10, 1.5)])
def test_blur_that_reaches_the_next_edge_is_stated(square_px: float, psf_px: float) -> None:
    seen = view(square_px, exposure=Exposure(psf_px=psf_px))
    refined = refine(seen.image, seen.found(), seen.board)
    assert len(refined) == len(seen.truth), refined.reason
    assert 0.6 < seen.squared_over_stated(refined).mean() < 1.5


@pytest.mark.parametrize("psf_px", [3.0, 4.0])
def test_much_blur(psf_px: float) -> None:
    seen = view(44, board=Checkerboard(6, 5, 0.03), exposure=Exposure(psf_px=psf_px))
    refined = refine(seen.image, seen.found(2.0), seen.board)
    assert len(refined) == len(seen.truth), refined.reason
    assert rms(seen.errors(refined)) < 0.035
    assert np.median(refined.edge_width_px) == pytest.approx(np.hypot(psf_px, np.sqrt(1 / 12)), rel=0.02)


@pytest.mark.parametrize("square_px", [12, 28])
def test_starts_two_pixels_off_end_in_the_same_places(square_px: float) -> None:
    seen = view(square_px)
    near, far = (refine(seen.image, seen.found(off), seen.board) for off in (0.0, 2.0))
    assert len(near) == len(far) == len(seen.truth)
    assert np.abs(near.pixels - far.pixels).max() < 0.003


def test_edge_width_and_contrast_are_those_of_the_photograph() -> None:
    light = Scene(white=200.0, black=40.0, shading=(0.0, 0.0))
    for bits in (8, 16):
        seen = view(scene=light, exposure=Exposure(psf_px=0.8, vignetting=0.0, bits=bits))
        refined = refine(seen.image, seen.found(), seen.board)
        assert np.median(refined.edge_width_px) == pytest.approx(np.hypot(0.8, np.sqrt(1 / 12)), rel=0.01)
        assert np.median(refined.contrast) == pytest.approx(160 / 255, rel=0.01)


def test_strong_shading_and_strong_distortion_do_not_move_corners() -> None:
    for seed in range(2):
        scene = Scene(shading=(1.0, -0.8))
        seen = view(26, 50, seed, focal_px=330.0, k1=-0.25, scene=scene, exposure=Exposure(vignetting=0.4))
        refined = refine(seen.image, seen.found(), seen.board)
        assert rms(seen.errors(refined)) < 0.007
        assert seen.squared_over_stated(refined).mean() < 1.4


def sharpened(grey: Floats, amount: float) -> Floats:
    """As cameras and phones do it: what a blur takes away is added."""
    return np.asarray(grey + amount * (grey - cv2.GaussianBlur(grey, (0, 0), 1.0)))


def compressed(grey: Floats, quality: int) -> Floats:
    pixels = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    file = cv2.imencode(".jpg", pixels, [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
    return np.asarray(cv2.imdecode(file, cv2.IMREAD_GRAYSCALE), dtype=np.float64)


def through_colour_filters(grey: Floats) -> Floats:
    """Each pixel sees one colour, and the others are filled in from its neighbours."""
    mosaic = np.clip(np.rint(grey), 0, 255).astype(np.uint8)
    return np.asarray(cv2.cvtColor(cv2.demosaicing(mosaic, cv2.COLOR_BayerBG2BGR), cv2.COLOR_BGR2GRAY), np.float64)


PROCESSED: dict[str, Callable[[Floats], Floats]] = {
    "compressed": lambda grey: compressed(grey, 75),
    "compressed much": lambda grey: compressed(grey, 30),
    "sharpened": lambda grey: sharpened(grey, 2.0),
    "sharpened and compressed": lambda grey: compressed(sharpened(grey, 1.0), 75),
    "colour": through_colour_filters,
    "colour, sharpened, compressed": lambda grey: compressed(sharpened(through_colour_filters(grey), 1.0), 85),
    "tone curve": lambda grey: 255 * (np.clip(grey, 0, 255) / 255) ** (1 / 2.2),
    "enlarged": lambda grey: cv2.resize(cv2.resize(grey, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA), SIZE),
}


@pytest.mark.parametrize("name", PROCESSED)
def test_photographs_that_a_camera_has_processed(name: str) -> None:
    for square_px, limit_px in ((14, 0.03), (32, 0.02)):
        seen = view(square_px, exposure=Exposure(noise=3.0))
        pixels = np.clip(np.rint(PROCESSED[name](seen.image.pixels.astype(np.float64))), 0, 255).astype(np.uint8)
        refined = refine(Image(name, pixels), seen.found(), seen.board)
        assert len(refined) == len(seen.truth), refined.reason
        assert rms(seen.errors(refined)) < limit_px
        assert seen.squared_over_stated(refined).mean() < 2.5


def test_markers_in_the_squares_stay_outside() -> None:
    board = installed().board("charuco:9x7:30mm:22mm:DICT_5X5_100")
    seen = view(42, board=board)
    refined = refine(seen.image, seen.found(), board)
    assert len(refined) == len(seen.truth), refined.reason
    assert rms(seen.errors(refined)) < 0.006


@settings(max_examples=25, deadline=None)
@given(
    square_px=st.floats(9, 60),
    tilt_deg=st.floats(0, 60),
    seed=st.integers(0, 10_000),
    psf_px=st.floats(0.3, 1.5),
    noise=st.floats(0.0, 6.0),
    bits=st.sampled_from([8, 16]),
)
def test_whatever_is_accepted_is_where_it_says(
    square_px: float, tilt_deg: float, seed: int, psf_px: float, noise: float, bits: int
) -> None:
    board = Checkerboard(5, 4, 0.03)
    exposure = Exposure(psf_px=min(psf_px, square_px / 10), noise=noise, bits=bits)
    seen = view(square_px, tilt_deg, seed, board=board, exposure=exposure)
    inside = np.all((seen.truth > 3) & (seen.truth < np.array(SIZE) - 4), axis=1)
    start = seen.found(1.0, seed).keeping(inside)
    refined = refine(seen.image, start, board)
    wrong = seen.squared_over_stated(refined) > 15  # beyond 5.5 sigma
    assert not np.any(wrong & (np.linalg.norm(seen.errors(refined), axis=1) > 0.02))
    ids = [corner.id for corner in refined.rejected]
    assert sorted([*refined.ids, *ids]) == sorted(start.ids)


@pytest.mark.parametrize("level", [20.0, 90.0, 190.0, 250.0])
@pytest.mark.parametrize("radius_px", [3.0, 8.0, 20.0])
def test_what_is_covered_is_rejected_and_what_is_not_is_kept(level: float, radius_px: float) -> None:
    plain = view(seed=3)
    spots = tuple(Spot(*(plain.truth[i] + [1.0, 0.5]), radius_px, level) for i in (14, 40, 62))
    seen = view(seed=3, scene=Scene(occluders=spots))
    refined = refine(seen.image, seen.found(), seen.board)
    distance = np.min([np.hypot(*(seen.truth - [s.x_px, s.y_px]).T) for s in spots], axis=0)
    if radius_px > 5:  # less leaves most of the edges to be seen, and they are enough
        assert not {14, 40, 62} & set(refined.ids.tolist())
    assert (seen.squared_over_stated(refined) < 15).all()
    assert set(np.flatnonzero(distance > radius_px + 24)) <= set(refined.ids.tolist())
    assert np.linalg.norm(seen.errors(refined), axis=1).max() < 0.3
    assert all(corner.reason for corner in refined.rejected)
    if refined.rejected:
        assert refined.reason.startswith(f"{len(refined.rejected)} of 88 corners rejected: ")


@pytest.mark.parametrize(("level", "radius_px"), [(30.0, 40.0), (60.0, 12.0), (300.0, 30.0)])
def test_reflections_are_modelled_or_named(level: float, radius_px: float) -> None:
    plain = view(seed=4)
    spot = Spot(*plain.truth[38], radius_px, level)
    seen = view(seed=4, scene=Scene(glare=(spot,)))
    refined = refine(seen.image, seen.found(), seen.board)
    assert seen.squared_over_stated(refined).mean() < 1.5
    assert np.linalg.norm(seen.errors(refined), axis=1).max() < 0.25
    if level > 200:
        assert 38 not in refined.ids
        assert {corner.reason for corner in refined.rejected if corner.id == 38} == {"glare"}


def test_corners_at_the_image_border_are_named() -> None:
    seen = view(middle=(0.2, 0.5))
    inside = np.all((seen.truth > 0) & (seen.truth < np.array(SIZE) - 1), axis=1)
    close = inside & (np.min([seen.truth, np.array(SIZE) - 1 - seen.truth], axis=(0, 2)) < 2)
    refined = refine(seen.image, seen.found(0.1).keeping(inside), seen.board)
    reasons = {corner.id: corner.reason for corner in refined.rejected}
    assert close.any()
    assert all(reasons[i] == "at the image border" for i in np.flatnonzero(close))
    assert rms(seen.errors(refined)) < 0.008


def test_narrow_outer_squares_only_make_the_window_smaller() -> None:
    scene = Scene(margin_squares=0.05, background=20.0, clutter=0.0)
    seen = view(scene=scene)
    cut = seen.image.pixels.copy()
    quarter = np.round(0.45 * (seen.truth[0] - seen.truth[1])).astype(int)
    mask = np.zeros(cut.shape, np.uint8)
    rim = np.array([seen.truth[0], seen.truth[77]]) + quarter
    cv2.fillPoly(mask, [np.vstack([rim, rim[::-1] + 3 * quarter]).round().astype(np.int32)], 1)
    cut[mask > 0] = 240
    refined = refine(Image("cut", cut), seen.found(), seen.board)
    first_column = np.arange(0, 88, 11)
    assert np.isin(first_column[1:-1], refined.ids).all(), refined.reason
    assert np.linalg.norm(seen.errors(refined), axis=1).max() < 0.1


def test_corners_of_the_other_colour_and_of_other_places_are_rejected() -> None:
    seen = view()
    pixels = seen.truth.copy()
    pixels[37] = seen.truth[38]  # a corner, but another one
    pixels[60] = (seen.truth[60] + seen.truth[61]) / 2  # on an edge
    pixels[70] = (seen.truth[70] + seen.truth[82]) / 2  # in the middle of a square
    refined = refine(seen.image, Detection(np.arange(88), pixels), seen.board)
    assert not {37, 60, 70} & set(refined.ids.tolist())
    reasons = {corner.id: corner.reason for corner in refined.rejected}
    assert reasons[37] == "black and white are exchanged"


def test_a_lonely_corner_has_no_known_size() -> None:
    seen = view()
    refined = refine(seen.image, seen.found().keeping(np.arange(88) == 30), seen.board)
    assert [corner.reason for corner in refined.rejected] == ["no corner beside it tells how large its squares are"]


def test_parts_of_a_board_give_the_same_corners() -> None:
    seen = view()
    whole = refine(seen.image, seen.found(), seen.board)
    chosen = np.isin(np.arange(88), [0, 1, 2, 11, 12, 13, 40, 41, 52])
    part = refine(seen.image, seen.found().keeping(chosen), seen.board)
    assert np.array_equal(part.ids, np.flatnonzero(chosen))
    assert np.abs(part.pixels - whole.pixels[chosen]).max() < 0.02


def test_threads_do_not_disturb_each_other() -> None:
    views = [view(seed=seed) for seed in range(4)]

    def fit(seen: View) -> Floats:
        return refine(seen.image, seen.found(), seen.board).pixels

    alone = [fit(seen) for seen in views]
    with ThreadPoolExecutor(4) as pool:
        together = list(pool.map(fit, views * 4))
    assert all(np.array_equal(a, b) for a, b in zip(alone * 4, together, strict=True))


@pytest.mark.parametrize("level", [0, 128, 255])
@pytest.mark.parametrize("size", [(20, 20), (200, 150), (1, 1), (3, 400)])
def test_an_image_of_one_level_has_no_corners(level: int, size: tuple[int, int]) -> None:
    image = Image("flat", np.full(size[::-1], level, dtype=np.uint8))
    x, y = np.meshgrid(np.linspace(0, size[0] - 1, 11), np.linspace(0, size[1] - 1, 8))
    refined = refine(image, Detection(np.arange(88), np.column_stack([x.ravel(), y.ravel()])), BOARD)
    assert len(refined) == 0
    assert len(refined.rejected) == 88


@settings(max_examples=40, deadline=None)
@given(data=st.data())
def test_nonsense_is_rejected_and_never_raises(data: st.DataObject) -> None:
    dtype = data.draw(st.sampled_from([np.uint8, np.uint16]))
    shape = data.draw(st.tuples(st.integers(1, 60), st.integers(1, 60)))
    pixels = data.draw(
        hnp.arrays(dtype, shape, fill=st.just(dtype(0)))
        | st.integers(0, 99).map(lambda s: np.random.default_rng(s).integers(0, 256, shape).astype(dtype))
    )
    n = data.draw(st.integers(1, 12))
    ids = data.draw(hnp.arrays(np.int64, n, elements=st.integers(0, 87), unique=True))
    where = data.draw(hnp.arrays(np.float64, (n, 2), elements=st.floats(-1e6, 1e6) | st.floats(0, 60)))
    refined = refine(Image("nonsense", pixels), Detection(ids, where), BOARD)
    assert len(refined) + len(refined.rejected) == n
    assert np.isfinite(refined.pixels).all()
    assert np.isfinite(refined.covariance).all()


def test_nothing_stays_nothing_and_strange_ids_are_named() -> None:
    image = Image("flat", np.zeros((9, 9), dtype=np.uint8))
    nothing = Detection.nothing("no board")
    assert refine(image, nothing, BOARD) is nothing
    with pytest.raises(InputError, match="11x8"):
        refine(image, Detection([88], [[1.0, 1.0]]), BOARD)


def test_bends_are_those_of_circles() -> None:
    radius = 900.0
    row, column = np.divmod(np.arange(88), 11)
    angle = (column - 5) * 30 / radius
    r = radius + 30 * row
    pixels = np.column_stack([r * np.sin(angle), r * np.cos(angle)]) + np.random.default_rng(0).normal(
        0, 0.004, (88, 2)
    )
    values, deviations = bends(pixels, np.arange(88), 11)
    # an edge along a row turns from x towards minus y: against the quarter turn from x to y
    assert values[:, 0] == pytest.approx(-1 / r, rel=0.05)
    assert values[:, 1] == pytest.approx(0, abs=3e-5)
    assert deviations.max() < 3e-5


def test_edges_come_from_neighbours_or_from_the_nearest_that_has_some() -> None:
    row, column = np.divmod(np.arange(88), 11)
    pixels = np.column_stack([20.0 * column, 15.0 * row])
    chosen = np.isin(np.arange(88), [0, 1, 11, 50])
    vectors, lengths = edges(pixels[chosen], np.flatnonzero(chosen), 11)
    assert np.allclose(vectors, [[20, 0], [0, 15]])
    assert np.allclose(lengths, [20, 15])


def test_displaced_corners_are_told_by_their_neighbours() -> None:
    seen = view(22, 50, focal_px=330.0, k1=-0.2)
    noise = np.random.default_rng(0).normal(0, 0.01, (88, 2))
    assert not displaced(seen.truth + noise, np.arange(88), 11).any()
    off = seen.truth + noise
    off[[16, 60]] += [[0.9, 0.8], [-1.5, 0.2]]
    assert np.array_equal(np.flatnonzero(displaced(off, np.arange(88), 11)), [16, 60])


@pytest.mark.parametrize("second_edge", [0.15 + np.pi / 2, 1.3, -2.2])
def test_derivatives_are_those_of_the_model(second_edge: float) -> None:
    from opencsp_calib.corner_kernel import layout as kernel
    from opencsp_calib.corner_kernel.image_model import differentiate

    grid = np.random.default_rng(1).uniform(-6, 6, (2, 200))
    table = np.zeros((kernel.COLUMNS, kernel.MOST_PIXELS))
    p = np.array([0.2, -0.1, 0.15, second_edge, 1.3, 100.0, 60.0, 0.03, -0.02, 0.01, 0.02])

    def columns(p: Floats) -> Floats:
        table[kernel.X, :200] = grid[0] - p[0]
        table[kernel.Y, :200] = grid[1] - p[1]
        differentiate(p, 0.002, -0.001, np.array([100.0, 100.0, np.inf, np.inf]), 200, table)
        return table[: kernel.RESIDUAL + 1, :200].copy()

    analytic = columns(p)
    for k in range(kernel.PARAMETERS):
        step = np.zeros(kernel.PARAMETERS)
        step[k] = 1e-5
        numeric = -(columns(p + step)[-1] - columns(p - step)[-1]) / 2e-5
        assert np.abs(numeric - analytic[k]).max() < 0.04 * np.abs(analytic[k]).max()


def test_importing_loads_no_compiler() -> None:
    code = "import sys, opencsp_calib.corners; sys.exit('numba' in sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_a_read_only_installation_without_a_home_keeps_its_code_in_a_private_folder(tmp_path: Path) -> None:
    package = Path(compiled.__file__).parent
    installation = tmp_path / "installation" / "opencsp_calib"
    shutil.copytree(package, installation, ignore=shutil.ignore_patterns("__pycache__", "gui", "report"))
    (installation / "corner_kernel" / "__pycache__").touch()  # a file, so that not even root can write into it
    nowhere = os.devnull + "/nowhere"
    places = {
        "PYTHONPATH": str(installation.parent),
        "HOME": nowhere,
        "XDG_CACHE_HOME": nowhere,
        "TMPDIR": str(tmp_path),
    }
    code = "from opencsp_calib.compiled import corner_fit; corner_fit()"
    environment = {key: value for key, value in os.environ.items() if key != "NUMBA_CACHE_DIR"} | places
    kept = []
    for _ in range(2):
        subprocess.run([sys.executable, "-c", code], check=True, env=environment, cwd=tmp_path)
        (folder,) = tmp_path.glob("opencsp-calib-compiled-*")
        assert folder.stat().st_mode & 0o077 == 0
        kept.append({file.name: file.stat().st_mtime_ns for file in folder.rglob("*.nbc")})
    assert kept[0]
    assert kept[0] == kept[1]


def test_compiled_code_is_of_what_every_file_of_the_kernel_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernel = tmp_path / "corner_kernel"
    shutil.copytree(compiled.KERNEL, kernel, ignore=shutil.ignore_patterns("__pycache__"))
    monkeypatch.setattr(compiled, "KERNEL", kernel)
    versions = {compiled._version()}
    for file in sorted(kernel.glob("*.py")):
        file.write_text(file.read_text(encoding="utf-8") + "# changed\n", encoding="utf-8")
        versions.add(compiled._version())
    assert len(versions) == 1 + len(list(kernel.glob("*.py")))


@pytest.mark.skipif(not hasattr(os, "geteuid"), reason="owners and modes are not kept here")
def test_a_folder_others_can_write_to_is_not_trusted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(compiled.tempfile, "gettempdir", lambda: str(tmp_path))
    folder = tmp_path / f"opencsp-calib-compiled-{os.geteuid()}"
    folder.mkdir()
    folder.chmod(0o777)
    with pytest.raises(PermissionError, match="belongs to somebody else"):
        compiled._private()
