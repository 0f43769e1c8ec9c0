"""Draws docs/images/capture_*.jpg: good and bad photographs of a board, each as a camera would take it.

Run ``python docs/scripts/photographs.py``.
"""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np

from opencsp_calib import Camera, Checkerboard
from opencsp_calib.arrays import Matrix
from opencsp_calib.image import Image
from opencsp_calib.rendering import render
from opencsp_calib.rendering.scene import Exposure, Scene, Spot
from opencsp_calib.synthetic import pose_in_view, turned

IMAGES = Path(__file__).resolve().parents[1] / "images"
CAMERA = Camera("capture", "opencv4", np.array([620.0, 620.0, 239.5, 182.5, -0.17, 0.1, 0.0, 0.0]), (480, 366))
BOARD = Checkerboard(15, 12, 0.05)
SHARP = Exposure(psf_px=0.5, noise=1.0)
LAMP = Spot(300.0, 150.0, 45.0, 260.0)
SHADOW = Scene(shading=(1.9, -0.3))


def held(tilt_deg: float, azimuth_deg: float, roll_deg: float = 0.0) -> Matrix:
    """Board to camera."""
    return turned(*np.radians([tilt_deg, azimuth_deg, roll_deg]))


TILTED = held(37.0, 60.0)
PHOTOGRAPHS = {  # name: how the board is held, how large, where in the image, scene, exposure
    "good_horizontal": (TILTED, 0.97, (0.5, 0.5), Scene(), SHARP),
    "good_vertical": (held(35.0, 160.0, 90.0), 0.97, (0.5, 0.5), Scene(room=1), SHARP),
    "good_corner": (held(40.0, 250.0), 0.75, (1.0, 0.0), Scene(room=2), SHARP),
    "bad_head_on": (held(2.0, 30.0), 0.9, (0.5, 0.5), Scene(), SHARP),
    "bad_small": (TILTED, 0.33, (0.4, 0.5), Scene(), SHARP),
    "bad_glare": (TILTED, 0.97, (0.5, 0.5), Scene(glare=(LAMP,)), SHARP),
    "bad_shadow": (TILTED, 0.97, (0.5, 0.5), SHADOW, SHARP),
    "bad_motion": (TILTED, 0.97, (0.5, 0.5), Scene(), replace(SHARP, motion_px=(9.0, 3.0))),
    "bad_focus": (TILTED, 0.97, (0.5, 0.5), Scene(), replace(SHARP, defocus_px=4.5)),
    "bad_exposure": (TILTED, 0.97, (0.5, 0.5), Scene(), replace(SHARP, gain=2.2)),
    "bad_covered": (TILTED, 0.97, (0.5, 0.5), Scene(occluders=(Spot(170.0, 330.0, 90.0, 60.0),)), SHARP),
}


def save(name: str, image: Image) -> None:
    """As a small JPEG."""
    cv2.imwrite(str(IMAGES / f"capture_{name}.jpg"), image.pixels, [cv2.IMWRITE_JPEG_QUALITY, 75])


def main() -> None:
    """Render them all."""
    for name, (rotation, fill, place, scene, exposure) in PHOTOGRAPHS.items():
        pose = pose_in_view(BOARD, CAMERA, rotation, fill, place)
        save(name, render(CAMERA, BOARD, pose, scene=scene, exposure=exposure))
    pose = pose_in_view(BOARD, CAMERA, TILTED, 0.97)
    nearer = pose.translation * np.array([1.0, 1.0, 0.72]) + np.array([0.12, 0.0, 0.0])  # than the whole board fits
    save("bad_cut", render(CAMERA, BOARD, replace(pose, translation=nearer), exposure=SHARP))


if __name__ == "__main__":
    main()
