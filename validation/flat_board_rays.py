"""What a flat board costs SOFAST: how far the rays of pixels are wrong.

Claim
    Taking Sandia's board as flat and evenly spaced turns the rays of pixels by more than a milliradian at the worst
    corner of the image and by half of one at the worst edge; SOFAST wants slopes to 0.1 mrad. It is the flat board that
    does it, not chance: from corners made from the camera and board as solved, with noise of 0.015 px, the flat board
    errs as much again, and the shape that is solved for twenty times less.

Way
    Ten photographs, 18 x 23 corners. "As before" is ``--preset opencsp``: OpenCV's corners and solver, a flat board.
    "Now" is the default of ``calibrate``. Rays are compared after the turn of the frame that fits best over the image
    has been taken out, as SOFAST's calibration of the scene takes it out. In the made world the camera, board and poses
    that were solved for are the truth; both solvers see the same noisy corners. Milliradians.

Run ``python validation/bench.py flat_board_rays``.
"""

import numpy as np
from _real_data import DATA

from opencsp_calib import Calibration, Camera, Checkerboard, calibrate, compare, solve
from opencsp_calib.arrays import Floats, Pixels
from opencsp_calib.synthetic import observe

BOARD = Checkerboard(18, 23, 0.05)
BEFORE = {"solver": "opencv", "board_shape": "flat", "pixel_aspect": "free", "weights": "equal", "robust": False}
PLACES = {"middle": [(0.5, 0.5)], "middles of the edges": [(0, 0.5), (1, 0.5), (0.5, 0), (0.5, 1)]}
PLACES["corners"] = [(0, 0), (1, 0), (0, 1), (1, 1)]
NOISE_PX, WORLDS = 0.015, 10


def angles_mrad(a: Camera, b: Camera, pixels: Pixels) -> Floats:
    """Between the rays of pixels, once the turn between the frames is taken out."""
    turned = a.unproject(pixels) @ compare(a, b).rotation.T
    return 1e3 * np.arcsin(np.linalg.norm(np.cross(turned, b.unproject(pixels)), axis=1))


def row(name: str, pairs: list[tuple[Camera, Camera]]) -> None:
    """One line of the table: rms over the worlds at each place, and the largest anywhere."""
    last = np.array(pairs[0][0].image_size) - 1.0
    cells = []
    for places in PLACES.values():
        found = np.array([angles_mrad(a, b, np.array(places) * last) for a, b in pairs])
        cells.append(f"{np.sqrt((found**2).mean(axis=0)).mean():.3f}, {found.max():.3f}")
    print(f"| {name} | {' | '.join(cells)} |", flush=True)


def made_again(now: Calibration, seed: int) -> tuple[Calibration, Calibration]:
    """A world that is as was solved; flat, and with its shape solved for."""
    seen = observe(now.camera, now.board, now.cam_from_board, noise_px=NOISE_PX, rng=seed, nominal=BOARD)
    return solve(seen, **BEFORE), solve(seen, board_shape="free", pixel_aspect="square")


def main() -> None:
    """Print the table."""
    images = DATA / "sandia_checkerboard" / "*.png"
    before = calibrate(images, BOARD, detector="opencsp", refine="none", **BEFORE)
    now = calibrate(images, BOARD)
    print(f"rms as before {before.rms_px:.4f} px, now {now.rms_px:.4f} px ({now.options.board_shape} board).")
    print("Each cell: rms over worlds, mean over the places; the largest.\n")
    print(f"| rays compared | {' | '.join(PLACES)} |\n|---|---|---|---|")
    row("photographs: as before, and now", [(before.camera, now.camera)])
    worlds = [made_again(now, seed) for seed in range(WORLDS)]
    row(f"made again, {WORLDS} worlds: flat board, and truth", [(flat.camera, now.camera) for flat, _ in worlds])
    row(f"made again, {WORLDS} worlds: shape solved for, and truth", [(free.camera, now.camera) for _, free in worlds])


if __name__ == "__main__":
    main()
