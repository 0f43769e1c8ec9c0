"""Checkerboards are found wherever they are, and their corners numbered as OpenCSP does."""

from pathlib import Path

import cv2
import h5py
import numpy as np
import pytest
from board_photographs import NEAR_PX, SIZE, Photograph, detected, small_camera
from opencsp_calib_opencv.checkerboard import CheckerboardDetector
from opencsp_calib_opencv.opencsp import OpenCSPDetector

from opencsp_calib import Checkerboard, Detection, Image
from opencsp_calib.images import find_images, read_image
from opencsp_calib.rendering import Exposure, Scene

BOARD = Checkerboard(9, 6, 0.05)
SANDIA = Checkerboard(18, 23, 0.05)


def find(image: Image, board: Checkerboard = BOARD) -> Detection:
    return detected(CheckerboardDetector(), image, board)


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


def test_a_hundred_megapixels() -> None:
    photograph = Photograph.of(BOARD)
    large = cv2.resize(photograph.image.pixels, None, fx=14.5, fy=14.5, interpolation=cv2.INTER_CUBIC)
    detection = find(Image("large", large))
    scale = np.array(large.shape[::-1]) / SIZE
    expected = (photograph.pixels + 0.5) * scale - 0.5
    assert len(detection) == 54
    assert np.linalg.norm(detection.pixels - expected, axis=1).max() < NEAR_PX + 3  # of the enlargement itself
