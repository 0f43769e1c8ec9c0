"""A coached set of photographs against a random one: how many views each needs for the same uncertainty.

Claim
    An operator who follows the coach's next view, with a person's scatter, reaches a given projection uncertainty with
    at most 60 % of the views of an operator who holds the board anywhere.

Way
    Random: poses uniform over range (near to three times as far), place in the view, tilt 0 to 60 degrees, its
    direction and roll, kept where the whole board is in view. Coached: after each view the coach learns from all of
    them (corners with 0.1 px of noise, solved from scratch) and asks for the next; the operator misses it by 6 degrees
    about each axis and by 6 % of the range in each direction (one sigma), tries again where part of the board is out of
    view. Uncertainty: expected rms over the image at infinity, frames aligned, from the normal equations at the true
    camera with all poses marginalised; the board known ("flat") or with its warp solved for as well. The error is that
    of the camera solved from the views, against the true one, median over the seeds.

Run ``python validation/bench.py coach``.
"""

import numpy as np
from scipy.spatial.transform import Rotation

from opencsp_calib import Camera, Checkerboard, Pose, SolveOptions
from opencsp_calib.coach import learn
from opencsp_calib.comparison import compare
from opencsp_calib.detection import Observations
from opencsp_calib.information import ProjectionGoal, view_information
from opencsp_calib.pipeline import solve
from opencsp_calib.synthetic import demo_camera, observe, outline, pose_in_view, turned

SEEDS = 6
NOISE_PX = 0.1
SCATTER_DEG, SCATTER_RANGE = 6.0, 0.06
RANDOM_VIEWS, COACHED_VIEWS = 50, 20
TARGETS = (10, 20, 30, 50)
SHAPES = ("flat", "warp")
WORLDS = {
    "1626 x 1236, f 2703, 22 x 19": (demo_camera(), Checkerboard(22, 19, 0.05)),
    "640 x 480, f 800, 9 x 6": (
        Camera("small", "opencv4", [800.0, 800.0, 330.0, 236.0, -0.12, 0.05, 1e-3, -5e-4], (640, 480)),
        Checkerboard(9, 6, 0.03),
    ),
}


def in_view(camera, board, pose):
    """Whether the whole board, with its outer squares, is in the image."""
    pixels = camera.project(pose.transform(outline(board)))
    return bool(((pixels > 0) & (pixels < np.array(camera.image_size) - 1)).all())


def at(board, rotation, centre):
    """The pose of a board that is turned so, its middle there."""
    return Pose.from_matrix(rotation, centre - rotation @ board.nominal_points.mean(axis=0))


def random_view(camera, board, rng):
    """Anywhere with the whole board in view."""
    near = np.linalg.norm(pose_in_view(board, camera, np.eye(3), 1.0).translation)
    while True:
        rotation = turned(np.radians(rng.uniform(0, 60)), *rng.uniform(0, 2 * np.pi, 2))
        ray = camera.unproject(rng.uniform([0, 0], camera.image_size)[None])[0]
        pose = at(board, rotation, ray * rng.uniform(near, 3 * near))
        if in_view(camera, board, pose):
            return pose


def held_by_a_person(camera, board, wanted, rng):
    """Near the pose wanted, with the whole board in view."""
    middle = wanted.transform(board.nominal_points.mean(axis=0)[None])[0]
    while True:
        turn = Rotation.from_rotvec(np.radians(SCATTER_DEG) * rng.normal(size=3)).as_matrix()
        shift = SCATTER_RANGE * np.linalg.norm(middle) * rng.normal(size=3)
        pose = at(board, turn @ wanted.matrix, middle + shift)
        if in_view(camera, board, pose):
            return pose


def views_of(camera, board, poses, seed):
    """What a detector would report."""
    return observe(camera, board, poses, noise_px=NOISE_PX, rng=seed).views


def coached(camera, board, rng, seed):
    """The poses of an operator who does what the coach says."""
    poses, known = [], None
    for _ in range(COACHED_VIEWS):
        known = learn(board, camera.image_size, views_of(camera, board, poses, seed), before=known)
        poses.append(held_by_a_person(camera, board, known.next_view.pose, rng))
    return poses


def sigmas(camera, board, poses, shape):
    """(V,) px expected uncertainty after each view."""
    options = SolveOptions(board_shape=shape)
    seen = observe(camera, board, poses).detections
    told = view_information(camera, board, seen, poses, options=options, sigma_px=NOISE_PX)
    return np.sqrt(ProjectionGoal.of(camera, board, options=options).variance_px2(np.cumsum(told, axis=0)))


def error_px(camera, board, poses, seed):
    """Of the camera solved from these views."""
    found = solve(Observations(board, camera.image_size, views_of(camera, board, poses, seed)))
    return compare(camera, found.camera).rms_px


def study(name, camera, board):
    """One world; prints its rows."""
    ratios = {(shape, n): [] for shape in SHAPES for n in TARGETS}
    errors = {"random 50": [], "coached 15": [], "coached 20": []}
    for seed in range(SEEDS):
        rng = np.random.default_rng(seed)
        anywhere = [random_view(camera, board, rng) for _ in range(RANDOM_VIEWS)]
        guided = coached(camera, board, rng, seed)
        for shape in SHAPES:
            random_px, coached_px = (sigmas(camera, board, poses, shape) for poses in (anywhere, guided))
            for n in TARGETS:
                reached = np.flatnonzero(coached_px <= random_px[n - 1])
                needed = reached[0] + 1 if len(reached) else np.inf
                ratios[shape, n].append(needed / n)
        errors["random 50"].append(error_px(camera, board, anywhere, seed))
        errors["coached 15"].append(error_px(camera, board, guided[:15], seed))
        errors["coached 20"].append(error_px(camera, board, guided, seed))
    for shape in SHAPES:
        cells = [f"{np.mean(ratios[shape, n]):.0%} ({max(ratios[shape, n]):.0%})" for n in TARGETS]
        print(f"| {name} | {shape} | {' | '.join(cells)} |", flush=True)
    return {kind: np.median(values) for kind, values in errors.items()}


def main():
    """All worlds."""
    print(f"Views a coached operator needs, in parts of the random operator's, mean of {SEEDS} seeds (worst seed):\n")
    print("| world | board | " + " | ".join(f"as after {n} random" for n in TARGETS) + " |")
    print("|---|---|" + "---|" * len(TARGETS))
    errors = {name: study(name, camera, board) for name, (camera, board) in WORLDS.items()}
    print("\nMedian error of the solved camera, px rms over the image:\n")
    print("| world | 50 random views | 15 coached | 20 coached |\n|---|---|---|---|")
    for name, found in errors.items():
        print(f"| {name} | " + " | ".join(f"{value:.4f}" for value in found.values()) + " |")


if __name__ == "__main__":
    main()
