"""Views chosen by information against views chosen at random, and what is lost against taking all of them.

Claim
    Of 1000 views, 60 chosen by information have at most 0.7 times the projection sigma of 60 chosen at random.

Way
    Worlds of a known camera (that of the demo, 1626 x 1236, opencv4) and a flat board, with independent noise of
    0.1 px. Two pools of 1000 views: *procedure*, every one taken as the procedure asks for (tilted by 30 to 45 degrees,
    filling six to nine tenths of the image), and *anyhow*, tilted by 0 to 60 degrees and filling three to nine and a
    half tenths. Sigma is that of projections at infinity, rms over the image, as the residuals give it; *error* is how
    far the solved camera is from the true one by `compare`. Random choices are the mean of ten.

Run ``python validation/bench.py view_selection``.
"""

from functools import partial
from statistics import fmean

import numpy as np

from opencsp_calib import Calibration, Camera, Checkerboard, Observations, compare, solve
from opencsp_calib.pipeline import select
from opencsp_calib.projection_sigma import sigma_map
from opencsp_calib.synthetic import demo_camera, observe, random_poses, seed_poses

OF, COUNT, RANDOM = 1000, 60, 10
OPTIONS = {"board_shape": "flat"}
quick = partial(solve, **OPTIONS)


def figures(observations: Observations, truth: Camera) -> tuple[float, float]:
    """Projection sigma and true error, px."""
    found: Calibration = quick(observations)
    sigma = sigma_map(found, covariance=found.covariance_residual).rms_px
    return sigma, compare(found.camera, truth).rms_px


def main() -> None:
    """Print the table."""
    camera, board = demo_camera(), Checkerboard(14, 10, 0.05)
    pools = {"procedure": seed_poses(board, camera, OF, rng=1), "anyhow": random_poses(board, camera, OF, rng=1)}
    print(f"{COUNT} of {OF} views\n")
    print("| pool | views | sigma px | of random | error px |\n|---|---|---|---|---|")
    for name, poses in pools.items():
        observations = observe(camera, board, poses, noise_px=0.1, rng=2)
        names, rng = [view.image for view in observations.used], np.random.default_rng(3)
        sets = [observations.keeping(rng.choice(names, COUNT, replace=False)) for _ in range(RANDOM)]
        by_chance = [figures(one, camera) for one in sets]
        random = (fmean(sigma for sigma, _ in by_chance), fmean(error for _, error in by_chance))
        rows = {
            "random": random,
            "by information": figures(select(observations, COUNT, **OPTIONS).observations, camera),
            f"all {OF}": figures(observations, camera),
        }
        for views, (sigma, error) in rows.items():
            print(f"| {name} | {views} | {sigma:.4f} | {sigma / random[0]:.2f} | {error:.4f} |", flush=True)
        print(f"| {name} | loss against all | | {rows['by information'][0] / rows[f'all {OF}'][0]:.2f} x | |")


if __name__ == "__main__":
    main()
