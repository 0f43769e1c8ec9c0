"""Checkerboards are found wherever they are, whole or in part; what is accepted is right, and the rest has a reason."""

import time
from pathlib import Path

import cv2
import h5py
import numpy as np
import pytest
from board_photographs import NEAR_PX, SIZE, Photograph, small_camera
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from opencsp_calib_opencv.checkerboard import CheckerboardDetector
from opencsp_calib_opencv.opencsp import OpenCSPDetector

from opencsp_calib import Checkerboard, Detection, Image
from opencsp_calib.errors import InputError
from opencsp_calib.images import find_images, read_image
from opencsp_calib.opencv import opencv_on_one_thread
from opencsp_calib.rendering import Exposure, Scene, Spot

BOARD = Checkerboard(9, 6, 0.05)
SANDIA = Checkerboard(18, 23, 0.05)
PLAIN = Scene(clutter=0.0)
MOST_SECONDS = 1.0


def find(image: Image, board: Checkerboard = BOARD) -> Detection:
    """Within the time that one image may take, on one core, whatever it shows."""
    with opencv_on_one_thread():
        begin = time.thread_time()
        detection = CheckerboardDetector().detect(image, board)
        assert time.thread_time() - begin < MOST_SECONDS
    assert len(detection) == len(board.points) or detection.reason
    return detection


def found_whole(photograph: Photograph) -> None:
    detection = find(photograph.image, photograph.board)
    assert len(detection) == len(photograph.board.points), detection.reason
    assert photograph.farthest_alike_px(detection) < NEAR_PX


# Real photographs


def expected_by_opencsp(data_dir: Path) -> np.ndarray:
    with h5py.File(data_dir / "sandia_checkerboard" / "expected_opencsp.h5") as file:
        return np.swapaxes(file["p_image_points"][()], 1, 2)


def test_opencsp_finds_what_opencsp_found(data_dir: Path) -> None:
    expected = expected_by_opencsp(data_dir)
    for file, corners in zip(find_images(data_dir / "sandia_checkerboard"), expected, strict=True):
        detection = OpenCSPDetector().detect(read_image(file), SANDIA)
        assert np.abs(detection.pixels - corners).max() < 1e-3
        assert np.array_equal(detection.ids, np.arange(414))


def test_every_view_of_sandia_with_the_order_that_opencsp_has(data_dir: Path) -> None:
    expected = expected_by_opencsp(data_dir)
    for file, corners in zip(find_images(data_dir / "sandia_checkerboard"), expected, strict=True):
        detection = find(read_image(file), SANDIA)
        assert len(detection) == 414
        assert np.linalg.norm(detection.pixels - corners, axis=1).max() < NEAR_PX


def test_every_view_of_opencv_left(data_dir: Path) -> None:
    files = [file for file in find_images(data_dir / "opencv_left") if file.name.endswith(".jpg")]
    assert len(files) == 13
    for file in files:
        image = read_image(file)
        detection = find(image, BOARD)
        assert len(detection) == 54, file.name
        found, corners = cv2.findChessboardCorners(image.pixels, (9, 6))
        assert found
        near = cv2.cornerSubPix(image.pixels, corners, (5, 5), (-1, -1), (3, 40, 0.001)).reshape(-1, 2)
        assert np.linalg.norm(detection.pixels - near, axis=1).max() < NEAR_PX


# Rendered photographs


@pytest.mark.parametrize("grid", [(9, 6), (18, 23), (7, 7), (8, 8), (4, 3), (3, 3), (14, 5)])
def test_boards_of_any_size(grid: tuple[int, int]) -> None:
    found_whole(Photograph.of(Checkerboard(*grid, 0.03), fill=0.9))


@pytest.mark.parametrize("tilt_deg", [0, 30, 45, 60])
@pytest.mark.parametrize("roll_deg", [0, 45, 91, 200])
def test_tilts_and_rolls(tilt_deg: float, roll_deg: float) -> None:
    found_whole(Photograph.of(BOARD, tilt_deg=tilt_deg, roll_deg=roll_deg))


@pytest.mark.parametrize(
    "exposure",
    [
        Exposure(psf_px=0.3),
        Exposure(psf_px=3.0),
        Exposure(defocus_px=8.0),
        Exposure(motion_px=(7.0, 4.0)),
        Exposure(noise=10.0),
        Exposure(bits=16),
        Exposure(gain=0.15),
        Exposure(gain=2.0),
    ],
    ids=str,
)
def test_exposures(exposure: Exposure) -> None:
    found_whole(Photograph.of(BOARD, exposure=exposure))


@pytest.mark.parametrize(
    "scene",
    [
        Scene(shading=(1.2, -0.9)),
        Scene(margin_squares=0.1),
        Scene(margin_squares=0.4, background=10.0, clutter=0.0),
        Scene(white=90.0, black=70.0),
        Scene(clutter=90.0, room=3),
    ],
    ids=["shading", "thin margin", "dark room", "low contrast", "clutter"],
)
def test_scenes(scene: Scene) -> None:
    found_whole(Photograph.of(BOARD, scene=scene))


def test_squares_of_eight_pixels() -> None:
    board = Checkerboard(12, 9, 0.05)
    photograph = Photograph.of(board, fill=0.14, tilt_deg=20)
    assert np.linalg.norm(photograph.pixels[1] - photograph.pixels[0]) < 9
    found_whole(photograph)


def test_a_wide_lens_bends_the_board() -> None:
    found_whole(Photograph.of(SANDIA, camera=small_camera(380.0, -0.22, 0.03), fill=0.9, tilt_deg=30))


def test_grey_levels_that_fill_a_part_of_sixteen_bits() -> None:
    whole = Photograph.of(BOARD, exposure=Exposure(bits=16))
    dim = Image("12 bit", whole.image.pixels // 16)  # whose white is not told: it looks 16 times too dark
    assert len(find(dim)) == 54


# Order


@pytest.mark.parametrize("roll_deg", range(0, 360, 36))
def test_one_end_of_an_asymmetric_board_is_first_however_it_is_held(roll_deg: int) -> None:
    photograph = Photograph.of(BOARD, roll_deg=roll_deg, fill=0.7)
    assert photograph.farthest_px(find(photograph.image)) < NEAR_PX


@pytest.mark.parametrize(
    ("grid", "first_deg", "period_deg"), [((7, 5), -135, 180), ((6, 6), -45, 90), ((5, 5), -135, 180)]
)
@pytest.mark.parametrize("roll_deg", range(-171, 180, 39))
def test_symmetric_boards_begin_at_one_side_of_the_image(
    grid: tuple[int, int], first_deg: int, period_deg: int, roll_deg: int
) -> None:
    board = Checkerboard(*grid, 0.03)
    photograph = Photograph.of(board, roll_deg=roll_deg, tilt_deg=0.5)
    detection = find(photograph.image, board)
    assert photograph.farthest_alike_px(detection) < NEAR_PX
    ids = np.arange(len(board.points)).reshape(grid[::-1])
    x, y = detection.pixels[ids[0, -1]] - detection.pixels[ids[0, 0]]
    roll = np.degrees(np.arctan2(y, x))
    assert (roll - first_deg) % 360 <= period_deg


def test_columns_and_rows_exchanged_are_the_same_board_turned() -> None:
    photograph = Photograph.of(BOARD)
    as_is, exchanged = find(photograph.image), find(photograph.image, Checkerboard(6, 9, 0.05))
    order, other = (np.lexsort(np.rint(d.pixels).T) for d in (as_is, exchanged))
    assert np.allclose(as_is.pixels[order], exchanged.pixels[other])


def test_mirrored_and_inverted_images_show_a_checkerboard_as_well() -> None:
    photograph = Photograph.of(BOARD)
    mirrored = Image("mirrored", np.ascontiguousarray(photograph.image.pixels[:, ::-1]))
    inverted = Image("inverted", 255 - photograph.image.pixels)
    for image in (mirrored, inverted):
        detection = find(image)
        assert len(detection) == 54
        (ax, ay), (bx, by) = detection.pixels[1] - detection.pixels[0], detection.pixels[9] - detection.pixels[0]
        assert ax * by - ay * bx > 0  # never from behind


# Parts of boards


@pytest.mark.parametrize("shift", [(0.45, 0.0), (-0.45, 0.05), (0.0, 0.45), (0.05, -0.4)])
def test_a_board_partly_out_of_view_gives_the_corners_that_can_be_told(shift: tuple[float, float]) -> None:
    photograph = Photograph.of(BOARD, tilt_deg=15, roll_deg=0, fill=0.85, shift=shift, scene=PLAIN)
    detection = find(photograph.image)
    inside = ((photograph.pixels > 10) & (photograph.pixels < np.array(SIZE) - 10)).all(axis=1).sum()
    assert 0.8 * inside <= len(detection) < 54
    assert photograph.farthest_px(detection) < NEAR_PX
    assert "out of view" in detection.reason


def test_a_corner_of_a_board_could_be_any_of_two_and_is_refused() -> None:
    photograph = Photograph.of(BOARD, tilt_deg=10, roll_deg=0, fill=0.9, shift=(0.4, 0.35), scene=PLAIN)
    detection = find(photograph.image)
    assert len(detection) == 0
    assert "which ones cannot be told" in detection.reason


def test_the_middle_of_a_board_is_refused() -> None:
    whole = Photograph.of(SANDIA, fill=0.95, tilt_deg=10).image
    middle = Image("middle", np.ascontiguousarray(whole.pixels[150:450, 250:550]))
    detection = find(middle, SANDIA)
    assert len(detection) == 0
    assert "which ones cannot be told" in detection.reason


def test_what_is_covered_is_left_out_and_the_rest_keeps_its_ids() -> None:
    photograph = Photograph.of(BOARD, tilt_deg=10)
    x, y = photograph.pixels[4 * 9 + 4]
    covered = Photograph.of(BOARD, tilt_deg=10, scene=Scene(occluders=(Spot(float(x), float(y), 45.0, 120.0),)))
    detection = find(covered.image)
    assert 40 <= len(detection) < 54
    assert 4 * 9 + 4 not in detection.ids
    assert covered.farthest_px(detection) < NEAR_PX


# What is not the board


def picture(kind: str) -> np.ndarray:
    rng = np.random.default_rng(1)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    if kind == "text":
        page = np.full(SIZE[::-1], 240, dtype=np.uint8)
        for line in range(20, 600, 18):
            text = "".join(chr(c) for c in rng.integers(33, 126, 60))
            cv2.putText(page, text, (5, line), cv2.FONT_HERSHEY_SIMPLEX, 0.6, 20, 1)
        return page
    waves = 60 * np.sin(2.9 * x) * np.sin(2.95 * y) + 50 * np.sin(0.3 * x + 0.02 * y)
    grey = {
        "blank": np.full_like(x, 128),
        "black": np.zeros_like(x),
        "saturated": np.full_like(x, 255),
        "noise": rng.integers(0, 256, x.shape),
        "faint noise": np.clip(128 + rng.normal(0, 3, x.shape), 0, 255),
        "moire": 128 + waves,
        "stripes": 255 * (x % 16 < 8),
        "tiled floor": 255 * ((x // 8 + y // 8) % 2),
        "waves": 128 + 100 * np.sin(0.2 * x) * np.sin(0.2 * y),
    }[kind]
    return grey.astype(np.uint8)


REASONS = {
    "blank": "one grey",
    "black": "black",
    "saturated": "saturated",
    "noise": "no 9x6 checkerboard",
    "faint noise": "no 9x6 checkerboard",
    "text": "no 9x6 checkerboard",
    "moire": "checkerboard",
    "stripes": "no 9x6 checkerboard",
    "tiled floor": "inner corners, not 9x6",
    "waves": "inner corners, not 9x6",
}


@pytest.mark.parametrize("kind", REASONS)
def test_what_is_no_board_has_a_reason(kind: str) -> None:
    detection = find(Image(kind, picture(kind)))
    assert len(detection) == 0
    assert REASONS[kind] in detection.reason


@pytest.mark.parametrize(
    ("grid", "reason"),
    [
        ((10, 7), "has 9x6 inner corners, not 10x7, which counts its squares"),
        ((7, 10), "write checkerboard:6x9"),
        ((8, 6), "has 9x6 inner corners, not 8x6"),
        ((9, 7), "has 9x6 inner corners, not 9x7"),
        ((20, 20), "has 9x6 inner corners, not 20x20"),
    ],
)
def test_another_board_is_named(grid: tuple[int, int], reason: str) -> None:
    detection = find(Photograph.of(BOARD, scene=PLAIN).image, Checkerboard(*grid, 0.05))
    assert len(detection) == 0
    assert reason in detection.reason


def test_two_boards_are_never_mixed() -> None:
    one = Photograph.of(BOARD, fill=0.7)
    two = Image("two", np.hstack([one.image.pixels, one.image.pixels]))
    detection = find(two)
    assert len(detection) == 0
    assert "two 9x6 checkerboards" in detection.reason


def test_a_much_smaller_board_in_the_background_is_left_alone() -> None:
    near, far = Photograph.of(BOARD, fill=0.9), Photograph.of(BOARD, fill=0.25)
    both = Image("both", np.vstack([near.image.pixels, far.image.pixels]))
    detection = find(both)
    assert len(detection) == 54
    assert near.farthest_px(detection) < NEAR_PX


@pytest.mark.parametrize("shape", [(1, 1), (20, 20), (1, 3000), (3000, 17), (15, 400)])
def test_tiny_and_thin_images(shape: tuple[int, int]) -> None:
    noise = np.random.default_rng(0).integers(0, 256, shape, dtype=np.uint8)
    for detector in (CheckerboardDetector(), OpenCSPDetector()):
        detection = detector.detect(Image("tiny", noise), BOARD)
        assert len(detection) == 0
        assert detection.reason


def test_a_hundred_megapixels() -> None:
    photograph = Photograph.of(BOARD)
    large = cv2.resize(photograph.image.pixels, None, fx=14.5, fy=14.5, interpolation=cv2.INTER_CUBIC)
    detection = find(Image("large", large))
    scale = np.array(large.shape[::-1]) / SIZE
    expected = (photograph.pixels + 0.5) * scale - 0.5
    assert len(detection) == 54
    assert np.linalg.norm(detection.pixels - expected, axis=1).max() < NEAR_PX + 3  # of the enlargement itself


# Properties

SEARCH = settings(
    max_examples=30,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.filter_too_much],
)
UNIT = st.floats(0, 1)


@SEARCH
@given(
    grid=st.tuples(st.integers(3, 14), st.integers(3, 14)),
    angles=st.tuples(st.floats(0, 55), st.floats(0, 360), st.floats(-180, 180)),
    place=st.tuples(UNIT, UNIT),
    shift=st.tuples(st.floats(-0.4, 0.4), st.floats(-0.4, 0.4)),
    spot=st.tuples(UNIT, UNIT, st.floats(1, 120), st.floats(0, 255)),
    psf_px=st.floats(0.3, 1.5),
    noise=st.floats(0, 6),
)
def test_accepted_corners_are_where_they_should_be(
    grid: tuple[int, int],
    angles: tuple[float, float, float],
    place: tuple[float, float],
    shift: tuple[float, float],
    spot: tuple[float, float, float, float],
    psf_px: float,
    noise: float,
) -> None:
    board = Checkerboard(*grid, 0.03)
    scene = Scene(occluders=(Spot(spot[0] * SIZE[0], spot[1] * SIZE[1], *spot[2:]),))
    tilt_deg, azimuth_deg, roll_deg = angles
    try:
        photograph = Photograph.of(
            board, tilt_deg=tilt_deg, azimuth_deg=azimuth_deg, roll_deg=roll_deg, position=place, shift=shift,
            scene=scene, exposure=Exposure(psf_px=psf_px, noise=noise),
        )  # fmt: skip
    except InputError:
        assume(False)
    assume(np.isfinite(photograph.pixels).all())
    detection = find(photograph.image, board)
    # a corner half covered may be drawn to the cover's edge; the fit that follows looks at it more closely
    off = [photograph.farthest_alike_px(detection.keeping(detection.ids != corner)) for corner in (-1, *detection.ids)]
    assert min(off, default=0) < NEAR_PX


@SEARCH
@given(
    pixels=st.tuples(st.integers(1, 90), st.integers(1, 90), st.integers(0, 2**32 - 1)),
    deep=st.booleans(),
    block=st.integers(1, 12),
)
def test_no_image_makes_it_fail(pixels: tuple[int, int, int], deep: bool, block: int) -> None:
    rng = np.random.default_rng(pixels[2])
    kind = np.uint16 if deep else np.uint8
    noise = rng.integers(0, np.iinfo(kind).max, pixels[:2], dtype=kind, endpoint=True)
    image = Image("any", np.kron(noise, np.ones((block, block), dtype=kind)))
    assert len(find(image, Checkerboard(3, 3, 0.01))) < 9
