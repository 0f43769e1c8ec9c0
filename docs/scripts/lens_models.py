"""Draws docs/images/lens_*.png: what each lens model does to a grid of lines.

Run ``python docs/scripts/lens_models.py``.
"""

from pathlib import Path

import matplotlib as mpl
import numpy as np

from opencsp_calib import Camera

mpl.use("Agg")
from matplotlib import pyplot as plt  # the backend comes first

IMAGES = Path(__file__).resolve().parents[1] / "images"
SIZE = (640, 480)
CORE = [420.0, 420.0, 319.5, 239.5]
LENSES = {
    "pinhole": ([], "straight lines stay straight"),
    "opencv4": ([-0.25, 0.05, 0.0, 0.0], "barrel: k1 < 0"),
    "opencv5": ([0.22, 0.02, 0.0, 0.0, 0.05], "pincushion: k1 > 0, and k3"),
    "opencv8": ([1.2, 0.3, 0.0, 0.0, 0.01, 1.55, 0.65, 0.06], "a wide angle: strong, without folding back"),
    "opencv12": ([0.0] * 8 + [0.08, 0.0, -0.06, 0.0], "thin prism alone: s1, s3"),
    "opencv14": ([0.0] * 12 + [0.25, -0.15], "a tilted sensor alone: tau_x, tau_y"),
    "opencv_fisheye": ([-0.02, 0.003, 0.0, 0.0], "angle in place of tangent: 180 degrees fit in"),
}


def lines(model: str) -> list[np.ndarray]:
    """Points (N, 3) of the lines of a grid before the camera: a wall; for a fisheye, the inside of a box."""
    reach, step = (6.0, 0.5) if model == "opencv_fisheye" else (1.2, 0.2)
    along = np.linspace(-reach, reach, 400)
    places = np.arange(-reach, reach + 1e-9, step)
    walls = [np.column_stack([along, np.full_like(along, p), np.ones_like(along)]) for p in places]
    return walls + [line[:, [1, 0, 2]] for line in walls]


def main() -> None:
    """Draw each on its own."""
    for model, (distortion, title) in LENSES.items():
        core = [200.0, 200.0, *CORE[2:]] if model == "opencv_fisheye" else CORE
        camera = Camera(model, model, np.array([*core, *distortion]), SIZE)
        bare = Camera("pinhole", "pinhole", np.array(core), SIZE)
        figure, axes = plt.subplots(figsize=(4.2, 3.3), dpi=100, layout="constrained")
        for line in lines(model):
            axes.plot(*bare.project(line).T, color="0.8", linewidth=0.8)
            axes.plot(*camera.project(line).T, color="tab:blue", linewidth=1.2)
        axes.set(xlim=(0, SIZE[0]), ylim=(SIZE[1], 0), aspect="equal", xticks=[], yticks=[])
        axes.set_title(f"{model}: {title}", fontsize=9)
        figure.savefig(IMAGES / f"lens_{model}.png")
        plt.close(figure)


if __name__ == "__main__":
    main()
