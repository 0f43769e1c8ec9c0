"""Rendered photographs are true: edges and corners by OpenCV's projection, light by brute force and by statistics."""

from collections.abc import Callable

import cv2
import numpy as np
import pytest
from opencsp_calib_opencv.board_kinds import CharucoKind
from scipy.interpolate import RectBivariateSpline

from opencsp_calib import Camera, CharucoBoard, Checkerboard, Image, InputError, Pose
from opencsp_calib.rendering import Exposure, Scene, Spot, render
from opencsp_calib.rendering.surface import look_up
from opencsp_calib.synthetic import bowed, demo_camera, pose_in_view, random_poses, seed_poses

CAMERA = Camera("small", "opencv5", [1100.0, 1104.0, 326.0, 231.0, -0.21, 0.13, 0.0009, -0.0011, 0.04], (640, 480))
BOARD = Checkerboard(7, 6, 0.03)
BARE = Scene(white=200.0, black=20.0, clutter=0.0, background=90.0, shading=(0.0, 0.0))
EXACT = {"noise": 0.0, "vignetting": 0.0, "bits": 16}


def levels(image: Image) -> np.ndarray:
    return image.pixels / 257.0 if image.pixels.dtype == np.uint16 else image.pixels.astype(float)


def project(points: np.ndarray, pose: Pose, camera: Camera = CAMERA) -> np.ndarray:
    points = np.asarray(points, dtype=np.float64).reshape(-1, 1, 3)
    rotation, translation = np.array(pose.rotation), np.array(pose.translation)
    if camera.model == "opencv_fisheye":
        return cv2.fisheye.projectPoints(points, rotation, translation, camera.matrix, np.array(camera.distortion))[0][
            :, 0
        ]
    return cv2.projectPoints(points, rotation, translation, camera.matrix, np.array(camera.distortion))[0][:, 0]


def edge_errors(
    image: np.ndarray, pose: Pose, height: Callable[[float, float], float], camera: Camera, reach: int, spread: float
) -> np.ndarray:
    """Along pixel rows across edges: the light says where the edge is, OpenCV says where it should be.

    A bent edge seen through a blur with the variance `spread` across rows is moved by half of that times its bend.
    """
    side, errors = BOARD.spacing_m, []
    for i in range(7):
        for j in range(5):

            def pixel(t: float, i: int = i, j: int = j) -> np.ndarray:
                x, y = i * side, (j + t) * side
                return project(np.array([[x, y, height(x, y)]]), pose, camera)[0]

            row, t = round(float(pixel(0.5)[1])), 0.5
            for _ in range(10):
                slope = (pixel(t + 1e-4)[1] - pixel(t - 1e-4)[1]) / 2e-4
                t -= (pixel(t)[1] - row) / slope
            x = pixel(t)[0]
            (x0, y0), (x1, y1), (x2, y2) = pixel(t - 0.1), pixel(t), pixel(t + 0.1)
            bend = 2.0 * ((x2 - x1) / (y2 - y1) - (x1 - x0) / (y1 - y0)) / (y2 - y0)
            profile = image[row, round(x) - reach : round(x) + reach + 1]
            before, after = profile[0], profile[-1]
            errors.append(
                round(x) - reach - 0.5 + ((profile - after) / (before - after)).sum() - x - 0.5 * bend * spread
            )
    return np.array(errors)


BLURS = [
    {"psf_px": 0.0},
    {"psf_px": 0.3},
    {"psf_px": 0.6},
    {"psf_px": 0.8, "defocus_px": 1.7},
    {"psf_px": 0.5, "motion_px": (2.5, 1.0)},
    {"psf_px": 2.0},
]


@pytest.mark.parametrize("blur", BLURS, ids=str)
@pytest.mark.parametrize("bow_m", [0.0, 0.002])
@pytest.mark.parametrize("turned", [False, True])
def test_edges_are_where_they_should_be(blur: dict[str, float], bow_m: float, turned: bool) -> None:
    tilt = Pose([0.35, 0.5, 0.05], [0.0, 0.0, 1.0]).matrix
    pose = pose_in_view(BOARD, CAMERA, tilt, 0.9, (0.4, 0.6))
    if turned:  # the same pixels transposed: edges across columns
        swap = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
        k = CAMERA.params
        camera = Camera("turned", "opencv5", [k[1], k[0], k[3], k[2], k[4], k[5], k[7], k[6], k[8]], (480, 640))
        swapped = pose_in_view(Checkerboard(6, 7, 0.03), camera, swap @ tilt @ swap, 0.9, (0.6, 0.4))
        board = Checkerboard(6, 7, 0.03)
        image = levels(render(camera, bowed(board, bow_m), swapped, scene=BARE, exposure=Exposure(**EXACT, **blur))).T
        pose = Pose.from_matrix(swap @ swapped.matrix @ swap, swap @ swapped.translation)
    else:
        image = levels(render(CAMERA, bowed(BOARD, bow_m), pose, scene=BARE, exposure=Exposure(**EXACT, **blur)))
    half = np.array([3.0, 2.5]) * BOARD.spacing_m

    def height(x: float, y: float) -> float:
        return bow_m * (1.0 - 0.5 * ((x / half[0] - 1.0) ** 2 + (y / half[1] - 1.0) ** 2))

    streak = blur.get("motion_px", (0.0, 0.0))[0 if turned else 1]
    spread = 1 / 12 + blur["psf_px"] ** 2 + blur.get("defocus_px", 0.0) ** 2 / 4 + streak**2 / 12
    errors = edge_errors(image, pose, height, CAMERA, 11, spread)
    assert np.abs(errors.mean()) < 5e-5
    assert np.sqrt((errors**2).mean()) < 1e-4
    assert np.abs(errors).max() < 3e-4


def test_edges_of_a_wide_fisheye_are_where_they_should_be() -> None:
    camera = Camera("wide", "opencv_fisheye", [420.0, 420.0, 322.0, 236.0, 0.02, -0.01, 0.003, -0.001], (640, 480))
    pose = pose_in_view(BOARD, camera, Pose([0.2, 0.3, 0.0], [0, 0, 1.0]).matrix, 0.9, (0.2, 0.8))
    image = levels(render(camera, BOARD, pose, scene=BARE, exposure=Exposure(**EXACT)))
    errors = edge_errors(image, pose, lambda x, y: 0.0, camera, 8, 1 / 12 + 0.6**2)
    assert np.sqrt((errors**2).mean()) < 2e-4


@pytest.mark.parametrize("rough_m", [0.0, 2e-5, 1e-4])
def test_pixels_of_corners_look_at_those_corners(rough_m: float) -> None:
    board = bowed(BOARD, 0.001)
    board = board.with_points(board.points + rough_m * np.random.default_rng(4).normal(size=board.points.shape))
    for pose in random_poses(board, CAMERA, 3, rng=1, tilt_deg=(20, 60), fill=(0.4, 0.9)):
        nodes = look_up(CAMERA, board, pose, 3)
        y, x = (np.arange(n) * nodes.step_px + nodes.first_px for n in nodes.x.shape)
        pixels = project(board.points, pose)
        seen = [RectBivariateSpline(y, x, places).ev(*pixels.T[::-1]) for places in (nodes.x, nodes.y)]
        off = np.transpose(seen) - board.nominal_points[:, :2]
        assert np.linalg.norm(off, axis=1).max() * 1100.0 / pose.translation[2] < 1e-4, "pixels, nearly"


def test_a_board_that_would_hide_parts_of_itself_is_refused() -> None:
    crumpled = BOARD.with_points(BOARD.points + 0.05 * np.random.default_rng(4).normal(size=BOARD.points.shape))
    with pytest.raises(InputError, match="bent so sharply"):
        render(CAMERA, crumpled, pose_in_view(BOARD, CAMERA, Pose([0.9, 0.0, 0.0], [0, 0, 1.0]).matrix, 0.9))


def brute_force(camera: Camera, board: CharucoBoard, pose: Pose, box: tuple[int, int, int, int], n: int) -> np.ndarray:
    """Mean level over each pixel of a box (x, y, width, height), n x n rays a pixel from a pinhole to a flat board."""
    drawing, margin = CharucoKind().draw(board), BARE.margin_squares * board.spacing_m
    x0, y0, width, height = box
    x = x0 - 0.5 + (np.arange(width * n) + 0.5) / n
    y = y0 - 0.5 + (np.arange(height * n) + 0.5) / n
    fx, fy, cx, cy = camera.params
    plane = np.stack(np.meshgrid((x - cx) / fx, (y - cy) / fy), axis=-1).reshape(-1, 2)
    rotation = cv2.Rodrigues(np.array(pose.rotation))[0]
    homography = np.linalg.inv(np.column_stack([rotation[:, :2], pose.translation]))
    places = np.column_stack([plane, np.ones(len(plane))]) @ homography.T
    u, v = (places[:, :2] / places[:, 2:]).T + np.array(drawing.origin_m)[:, None]
    light = np.full(len(u), 90.0)
    on_sheet = (u > -margin) & (u < drawing.width_m + margin) & (v > -margin) & (v < drawing.height_m + margin)
    light[on_sheet] = 20.0 if drawing.dark else 200.0
    for r in drawing.rectangles:
        light[(u > r.x_m) & (u < r.x_m + r.width_m) & (v > r.y_m) & (v < r.y_m + r.height_m)] = (
            200.0 if r.white else 20.0
        )
    return light.reshape(height, n, width, n).mean(axis=(1, 3))


@pytest.mark.parametrize("inverted", [False, True])
@pytest.mark.parametrize("roll", [0.0, 0.7])
def test_light_is_what_brute_force_gives(inverted: bool, roll: float) -> None:
    board = CharucoBoard(4, 3, 0.04, 0.03, "DICT_4X4_50", inverted)
    rotation = Pose([0.4, -0.3, 0.0], [0, 0, 1.0]).matrix @ Pose([0.0, 0.0, roll], [0, 0, 1.0]).matrix
    camera = Camera("pinhole", "pinhole", CAMERA.params[:4], CAMERA.image_size)
    pose = pose_in_view(board, camera, rotation, 0.5)
    drawing = CharucoKind().draw(board)
    image = levels(render(camera, board, pose, drawing=drawing, scene=BARE, exposure=Exposure(psf_px=0.0, **EXACT)))
    x, y = np.floor(project(board.points, pose, camera).min(axis=0)).astype(int) - 18
    box = (int(x), int(y), 40, 36)  # around a corner, and into the markers beside it
    n = 32
    rendered = image[y : y + 36, x : x + 40]
    error = rendered - brute_force(camera, board, pose, box, n)
    assert np.ptp(rendered) > 170
    assert np.abs(error).max() < 180.0 / n, "of the error of counting rays, not more"
    assert abs(error.mean()) < 0.02


@pytest.mark.parametrize(
    ("blur", "variance"),
    [
        ({"psf_px": 0.3}, 0.3**2),
        ({"psf_px": 0.6}, 0.6**2),
        ({"psf_px": 2.5}, 2.5**2),
        ({"psf_px": 4.0}, 4.0**2),
        ({"psf_px": 0.6, "defocus_px": 2.0}, 0.6**2 + 2.0**2 / 4),
        ({"psf_px": 0.6, "motion_px": (3.0, 0.0)}, 0.6**2 + 3.0**2 / 12),
        ({"psf_px": 0.6, "motion_px": (0.0, 3.0)}, 0.6**2),
    ],
    ids=str,
)
def test_edges_are_as_wide_as_asked(blur: dict[str, float], variance: float) -> None:
    camera = Camera("plain", "pinhole", [1000.0, 1000.0, 150.0, 120.0], (300, 240))
    board = Checkerboard(3, 3, 0.1)
    widths = []
    for shift in np.linspace(0.0, 1.0, 13, endpoint=False):
        pose = Pose([0.0, 0.0, 0.0], [-0.1 + shift * 1e-3, -0.05, 1.0])  # squares of 100 px, an edge near x = 150
        image = levels(render(camera, board, pose, scene=BARE, exposure=Exposure(**EXACT, **blur)))
        rise = np.diff(image[120, 115:186])
        rise /= rise.sum()
        at = np.arange(len(rise))
        widths.append((rise * at**2).sum() - (rise * at).sum() ** 2)
    # the pixel, and the difference of two pixels, are as wide as a pixel each
    assert np.mean(widths) - 2.0 / 12.0 == pytest.approx(variance, rel=0.01)


def test_detectors_find_the_corners_in_order() -> None:
    camera, board = demo_camera(), bowed(Checkerboard(21, 18, 0.05), 0.001)
    pose = seed_poses(board, camera, 3)[1]
    image = render(camera, board, pose)
    truth = project(board.points, pose, camera)
    assert image.size == camera.image_size
    found, corners = cv2.findChessboardCornersSB(image.pixels, (21, 18), flags=cv2.CALIB_CB_ACCURACY)
    assert found
    error = corners.reshape(-1, 2) - truth
    if np.abs(error).max() > 20:  # OpenCV may begin at the other end, which nothing on its side decides
        error = corners.reshape(-1, 2)[::-1] - truth
    assert np.sqrt((error**2).mean()) < 0.05
    assert np.abs(error.mean(axis=0)).max() < 0.01


@pytest.mark.parametrize("flags", [(False, False), (True, False), (False, True)])
def test_charuco_boards_are_recognised(flags: tuple[bool, bool]) -> None:
    board = CharucoBoard(7, 6, 0.04, 0.03, "DICT_5X5_50", *flags)
    drawing = CharucoKind().draw(board)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_50)
    opencv_board = cv2.aruco.CharucoBoard((7, 6), 0.04, 0.03, dictionary)
    opencv_board.setLegacyPattern(board.legacy)
    for pose in random_poses(board, CAMERA, 3, rng=2, tilt_deg=(20, 40), fill=(0.8, 0.95)):
        pixels = render(CAMERA, board, pose, drawing=drawing).pixels
        pixels = ~pixels if board.inverted else pixels
        corners, ids, _, _ = cv2.aruco.CharucoDetector(opencv_board).detectBoard(pixels)
        assert len(ids) >= 28
        truth = project(board.points, pose)[ids.ravel()]
        assert np.sqrt(((corners.reshape(-1, 2) - truth) ** 2).mean()) < 0.15


def flat_patch(exposure: Exposure, scene: Scene = BARE) -> Image:
    """A white square of 100 px in the middle of the image, and nothing else within x and y from 30 to 110 px."""
    camera = Camera("plain", "pinhole", [1000.0, 1000.0, 70.0, 70.0], (140, 140))
    return render(camera, Checkerboard(3, 3, 0.1), Pose([0, 0, 0], [0.05, -0.05, 1.0]), scene=scene, exposure=exposure)


def test_noise_is_as_strong_as_asked() -> None:
    calm = levels(flat_patch(Exposure(noise=3.0, vignetting=0.0, bits=16)))[30:110, 30:110]
    assert calm.mean() == pytest.approx(200.0, abs=0.2)
    assert calm.std() == pytest.approx(3.0, rel=0.03)
    assert flat_patch(Exposure(noise=0.0, vignetting=0.0)).pixels[70, 70] == 200


def test_the_same_seed_gives_the_same_noise_and_another_does_not() -> None:
    pose = pose_in_view(BOARD, CAMERA, np.eye(3), 0.5)
    first, again, other = (render(CAMERA, BOARD, pose, rng=seed).pixels for seed in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)


def test_depth_gain_and_clipping() -> None:
    bright = flat_patch(Exposure(gain=2.0, bits=16))
    assert bright.pixels.dtype == np.uint16
    assert (bright.pixels[40:100, 40:100] == 65535).all()
    assert flat_patch(Exposure()).pixels.dtype == np.uint8


def test_light_falls_off_towards_the_corners() -> None:
    wall = Camera("plain", "pinhole", [1000.0, 1000.0, 100.0, 100.0], (201, 201))
    behind = Pose([0, 0, 0], [0.0, 0.0, -1.0])
    exposure = Exposure(vignetting=0.4, noise=0.0, bits=16)
    image = levels(render(wall, BOARD, behind, scene=BARE, exposure=exposure))
    assert image[100, 100] == pytest.approx(90.0, rel=0.001)
    assert image[0, 0] == pytest.approx(90.0 * 0.6, rel=0.01)
    assert image[100, 0] == pytest.approx(90.0 * 0.8, rel=0.01)
    shaded = levels(render(wall, BOARD, behind, scene=BARE, exposure=Exposure(**EXACT)))
    assert np.allclose(shaded, 90.0, atol=0.01), "a board behind the camera is not seen"


def test_reflections_and_things_in_the_way() -> None:
    glare = flat_patch(Exposure(**EXACT), Scene(**{**vars(BARE), "glare": (Spot(70, 70, 5, 40),)}))
    assert levels(glare)[70, 70] == pytest.approx(240, abs=1)
    assert levels(glare)[70, 75] == pytest.approx(200 + 40 * np.exp(-0.5), abs=1)
    covered = flat_patch(Exposure(**EXACT), Scene(**{**vars(BARE), "occluders": (Spot(70, 70, 10, 60),)}))
    assert levels(covered)[70, 70] == pytest.approx(60, abs=0.1)
    assert levels(covered)[70, 85] == pytest.approx(200, abs=0.1)
    missing_light = (200.0 - levels(covered)[40:100, 40:100]).sum() / 140.0
    assert missing_light == pytest.approx(np.pi * 10**2, rel=0.01)


def test_what_cannot_be_rendered() -> None:
    charuco = CharucoBoard(4, 3, 0.04, 0.03, "DICT_4X4_50")
    with pytest.raises(InputError, match="give its drawing"):
        render(CAMERA, charuco, Pose([0, 0, 0], [0, 0, 1.0]))
    with pytest.raises(InputError, match="8 or 16 bits"):
        Exposure(bits=12)
    with pytest.raises(InputError, match="between 0 and 30"):
        Exposure(psf_px=-1.0)
    with pytest.raises(InputError, match="must not be negative"):
        Exposure(noise=-1.0)
