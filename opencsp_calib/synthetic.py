"""Worlds with known answers: cameras, poses and shaped boards whose truth is known, and what would be seen of them.

Images of such worlds are made by `opencsp_calib.rendering`.
"""

from collections.abc import Sequence

import numpy as np
from scipy.spatial.transform import Rotation

from opencsp_calib.arrays import Floats, Matrix, Points
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Detection, Observations, View
from opencsp_calib.errors import InputError
from opencsp_calib.pose import Pose

__all__ = ["bowed", "demo_camera", "observe", "outline", "pose_in_view", "random_poses", "seed_poses", "turned"]

BORDER_PX = 4.0  # between the board's outline and the image's edge: a corner at the very edge cannot be localised
MAX_STEPS = 200


def demo_camera() -> Camera:
    """A camera much like Sandia's: 1626 x 1236 square pixels, f about 2700 px, barrel distortion, not quite centred."""
    params = [2703.4, 2703.4, 829.6, 626.3, -0.172, 0.196, 0.00062, -0.00048]
    return Camera("demo", "opencv4", np.array(params), (1626, 1236))


def bowed(board: Board, height_m: float) -> Board:
    """The board with a smooth bow: a paraboloid whose middle lies this much higher (in z) than its four end corners.

    Parameters
    ----------
    board : Board
    height_m : float
        Peak to valley over the corners, metres; a negative one bows it towards a camera that faces it.
    """
    x, y = _unit_coordinates(board)
    heights = height_m * (1.0 - 0.5 * (x * x + y * y))
    return board.with_points(board.points + np.outer(heights, [0.0, 0.0, 1.0]))


def outline(board: Board, margin_squares: float = 1.0) -> Points:
    """Points along the rim of the board, (40, 3) m: a rectangle this many spacings beyond its outermost corners.

    One spacing is the rim of the outer squares of a checkerboard or ChArUco board.
    """
    columns, rows = board.grid
    side = np.linspace(0.0, 1.0, 11)[:-1]
    ends = np.zeros_like(side)
    x = np.concatenate([side, ends + 1.0, 1.0 - side, ends]) * (columns - 1 + 2 * margin_squares) - margin_squares
    y = np.concatenate([ends, side, ends + 1.0, 1.0 - side]) * (rows - 1 + 2 * margin_squares) - margin_squares
    return np.column_stack([x, y, np.zeros_like(x)]) * board.spacing_m


def pose_in_view(
    board: Board, camera: Camera, rotation: Matrix, fill: float, position: tuple[float, float] = (0.5, 0.5)
) -> Pose:
    """The pose that shows a turned board wholly, at a given size and place in the image.

    Parameters
    ----------
    board : Board
    camera : Camera
    rotation : (3, 3)
        Board to camera; the identity shows the board head-on, its columns along the image's x.
    fill : float
        In (0, 1]: how much of the image's width or height, whichever comes first, its outer squares span.
    position : (float, float)
        Where in the room that is left it lies: (0, 0) towards the upper left corner of the image, (1, 1) the lower
        right.

    Raises
    ------
    InputError
        If the camera cannot see it like that.
    """
    rim = (outline(board) - board.nominal_points.mean(axis=0)) @ rotation.T
    room = np.array(camera.image_size) - 1.0 - 2.0 * BORDER_PX
    focal = camera.params[:2]
    centre = np.array([0.0, 0.0, float((np.ptp(rim, axis=0)[:2] * focal / room).max() / fill)])
    for _ in range(MAX_STEPS):
        pixels = camera.project(rim + centre)
        if not np.isfinite(pixels).all():
            centre *= [0.8, 0.8, 1.2]
            continue
        low, size = pixels.min(axis=0), np.ptp(pixels, axis=0)
        excess = float((size / room).max()) / fill
        missing = BORDER_PX + np.array(position) * (room - size) - low
        if abs(excess - 1.0) < 1e-3 and np.abs(missing).max() < 0.5:
            return Pose.from_matrix(rotation, centre - rotation @ board.nominal_points.mean(axis=0))
        # half steps: a board at the rim of a wide view grows as it moves outwards, and full ones would overshoot
        centre[:2] += 0.5 * missing * centre[2] / focal
        centre *= np.sqrt(excess)
    raise InputError(f"no pose shows {board.spec} with {fill:.0%} of the image filled; ask for less")


def seed_poses(board: Board, camera: Camera, views: int = 50, rng: np.random.Generator | int = 0) -> tuple[Pose, ...]:
    """Poses as the seed's procedure asks for them.

    The board's normal is 30 to 45 degrees from the optical axis, in all directions; the first half of the views holds
    the board horizontal, the second half turned by 90 degrees; the board is wholly in view, spans six to nine tenths
    of the image, and moves over all its corners, edges and middle.

    Returns
    -------
    tuple of Pose
        Board to camera.
    """
    rng = np.random.default_rng(rng)
    places = _spread_places(views, rng)
    poses = []
    for view in range(views):
        roll = np.deg2rad(rng.normal(0.0, 3.0) + (90.0 if view >= (views + 1) // 2 else 0.0))
        azimuth = 2.0 * np.pi * (view * (np.sqrt(5.0) - 1.0) / 2.0 + rng.uniform(-0.03, 0.03))
        tilt = np.deg2rad(rng.uniform(30.0, 45.0))
        fill = rng.uniform(0.6, 0.9)
        poses.append(pose_in_view(board, camera, turned(tilt, azimuth, roll), fill, places[view]))
    return tuple(poses)


def random_poses(
    board: Board,
    camera: Camera,
    views: int,
    rng: np.random.Generator | int = 0,
    *,
    tilt_deg: tuple[float, float] = (0.0, 60.0),
    roll_deg: tuple[float, float] = (-180.0, 180.0),
    fill: tuple[float, float] = (0.3, 0.95),
) -> tuple[Pose, ...]:
    """Poses that show the whole board anywhere in the image, turned and tilted at random.

    Parameters
    ----------
    board : Board
    camera : Camera
    views : int
    rng : Generator or int
        A seed makes the same poses every time.
    tilt_deg : (float, float)
        Least and greatest angle between the board's normal and the optical axis.
    roll_deg : (float, float)
        Least and greatest turn of the board in its own plane.
    fill : (float, float)
        Least and greatest part of the image's width or height that the board spans.

    Returns
    -------
    tuple of Pose
        Board to camera.
    """
    rng = np.random.default_rng(rng)
    poses = []
    for _ in range(views):
        tilt, roll = np.deg2rad(rng.uniform(*tilt_deg)), np.deg2rad(rng.uniform(*roll_deg))
        rotation = turned(tilt, rng.uniform(0.0, 2.0 * np.pi), roll)
        place = (rng.uniform(), rng.uniform())
        poses.append(pose_in_view(board, camera, rotation, rng.uniform(*fill), place))
    return tuple(poses)


def observe(
    camera: Camera,
    board: Board,
    poses: Sequence[Pose],
    *,
    noise_px: float = 0.0,
    rng: np.random.Generator | int = 0,
    correlation: float = 0.0,
    flex_m: float = 0.0,
    nominal: Board | None = None,
) -> Observations:
    """What a perfect detector would report of a board: exact projections, and noise as asked for.

    Parameters
    ----------
    camera : Camera
    board : Board
        As it truly is.
    poses : sequence of Pose
        Board to camera; one view each.
    noise_px : float
        Standard deviation per axis.
    rng : Generator or int
        A seed makes the same noise every time.
    correlation : float
        Of the noise of neighbouring corners, in [0, 1); it falls off geometrically along rows and along columns. The
        standard deviation of each corner stays `noise_px`.
    flex_m : float
        The board bends and twists smoothly from view to view, this much rms over board and views, metres.
    nominal : Board, optional
        What the observer takes the board for (`Observations.board`); by default flat and evenly spaced.

    Returns
    -------
    Observations
        Corners outside the image are left out. Each corner's covariance is that of the noise, None where there is
        none; it knows nothing of correlation and flex, as a detector would not.
    """
    rng = np.random.default_rng(rng)
    views = []
    for index, pose in enumerate(poses):
        points = board.points + np.outer(_flex(board, flex_m, rng), [0.0, 0.0, 1.0])
        pixels = camera.project(pose.transform(points)) + noise_px * _neighbourly_noise(board, correlation, rng)
        views.append(_view(f"view_{index + 1:03d}", pixels, camera, noise_px))
    return Observations(nominal or board.with_points(board.nominal_points), camera.image_size, tuple(views))


def _view(name: str, pixels: Floats, camera: Camera, noise_px: float) -> View:
    with np.errstate(invalid="ignore"):
        inside = ((pixels >= -0.5) & (pixels <= np.array(camera.image_size) - 0.5)).all(axis=1)
    if not inside.any():
        return View(name, Detection.nothing("the board is out of view"), "no board")
    ids = np.flatnonzero(inside)
    covariance = np.tile(noise_px**2 * np.eye(2), (len(ids), 1, 1)) if noise_px > 0 else None
    return View(name, Detection(ids, pixels[ids], covariance), "used")


def turned(tilt_rad: float, azimuth_rad: float, roll_rad: float) -> Matrix:
    """Rolled in its own plane, then tilted about an axis across the line of sight."""
    tilt = Rotation.from_rotvec(tilt_rad * np.array([np.cos(azimuth_rad), np.sin(azimuth_rad), 0.0]))
    return np.asarray((tilt * Rotation.from_rotvec([0.0, 0.0, roll_rad])).as_matrix(), dtype=np.float64)


def _spread_places(views: int, rng: np.random.Generator) -> list[tuple[float, float]]:
    """Places in the room left: all nine of corners, edges and middle in random order, scattered a little, and again."""
    nine = np.array([(x, y) for y in (0.0, 0.5, 1.0) for x in (0.0, 0.5, 1.0)])
    rounds = [rng.permutation(nine) for _ in range(-(-views // 9))]
    places = np.concatenate(rounds)[:views] if rounds else np.empty((0, 2))
    places = np.clip(places + rng.uniform(-0.12, 0.12, places.shape), 0.0, 1.0)
    return [(float(x), float(y)) for x, y in places]


def _unit_coordinates(board: Board) -> tuple[Floats, Floats]:
    """(K,) x and y of the nominal corners, from -1 at the first to 1 at the last."""
    columns, rows = board.grid
    y, x = np.mgrid[-1.0 : 1.0 : rows * 1j, -1.0 : 1.0 : columns * 1j]
    return x.ravel(), y.ravel()


def _flex(board: Board, rms_m: float, rng: np.random.Generator) -> Floats:
    """(K,) m heights of a board bent along both axes and twisted at random."""
    x, y = _unit_coordinates(board)
    shapes = np.stack([x * x, y * y, x * y])
    shapes -= shapes.mean(axis=1, keepdims=True)
    shapes /= np.sqrt((shapes**2).mean(axis=1, keepdims=True))
    # the three shapes are uncorrelated over the board, so that their mean squares add up
    return np.asarray(rng.normal(size=3) @ shapes * (rms_m / np.sqrt(3.0)), dtype=np.float64)


def _neighbourly_noise(board: Board, correlation: float, rng: np.random.Generator) -> Floats:
    """(K, 2) of unit variance, each correlated with its neighbours: an AR(1) process along rows and along columns."""
    if not 0.0 <= correlation < 1.0:
        raise InputError(f"the correlation of neighbouring corners must be in [0, 1), not {correlation}")
    columns, rows = board.grid
    noise = rng.normal(size=(rows, columns, 2))
    fresh = np.sqrt(1.0 - correlation**2)
    for line in (noise, noise.swapaxes(0, 1)):
        for k in range(1, len(line)):
            line[k] = correlation * line[k - 1] + fresh * line[k]
    return noise.reshape(-1, 2)
