"""Solving by ``bundle``, and small worlds for its tests: a board, views of it, corners changed, moved and left out."""

from dataclasses import replace

import numpy as np
from opencsp_calib_bundle.solver import BundleSolver

from opencsp_calib.board import Checkerboard
from opencsp_calib.options import SolveOptions
from opencsp_calib.synthetic import demo_camera, observe, random_poses

SMALL = Checkerboard(9, 7, 0.04)


def solved(observations, model="opencv4", **options):
    return BundleSolver().solve(observations, model, SolveOptions(**options))


def small_world(views=10, noise_px=0.0, camera=None, truth=SMALL, seed=1, **poses):
    camera = camera or demo_camera()
    chosen = random_poses(SMALL, camera, views, seed, **{"tilt_deg": (20.0, 50.0), "fill": (0.5, 0.9), **poses})
    return observe(camera, truth, chosen, noise_px=noise_px, rng=seed, nominal=SMALL)


def changed(observations, change):
    """The detection of every view, changed by a function of its index and itself."""
    views = [replace(view, detection=change(i, view.detection)) for i, view in enumerate(observations.views)]
    return replace(observations, views=tuple(views))


def spoilt(observations, share, size_px, seed=0):
    """Some corners of every view moved by about as many pixels each way, and which."""
    rng = np.random.default_rng(seed)
    masks = [rng.random(len(d)) < share for d in observations.detections]

    def move(index, detection):
        shift = size_px * rng.choice([-1.0, 1.0], (len(detection), 2)) * rng.uniform(0.7, 1.3, (len(detection), 2))
        return replace(detection, pixels=detection.pixels + shift * masks[index][:, None])

    return changed(observations, move), masks


def codes(calibration):
    return {problem.code for problem in calibration.problems}
