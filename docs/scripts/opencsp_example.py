"""A calibration put into OpenCSP's own Camera, and the rays that SOFAST would take from it, old and new.

Run ``python docs/scripts/opencsp_example.py camera_as_before.h5 camera.h5`` where OpenCSP is installed.
"""

import sys

import numpy as np
from opencsp.common.lib.camera.Camera import Camera as OpenCSPCamera
from opencsp.common.lib.geometry.Vxy import Vxy

from opencsp_calib import Camera, compare


def main(old: str, new: str) -> None:
    """Print the angles between the rays, at the middle and at the corners of the image."""
    turn = compare(Camera.load(old), Camera.load(new)).rotation  # SOFAST's own calibration takes this out
    before, now = OpenCSPCamera.load_from_hdf(old), OpenCSPCamera.load_from_hdf(new)
    width, height = (int(n) for n in now.image_shape_xy)
    places = {
        "middle": ((width - 1) / 2, (height - 1) / 2),
        "upper left": (0, 0),
        "lower right": (width - 1, height - 1),
    }
    for name, (x, y) in places.items():
        pixel = Vxy(np.array([[float(x)], [float(y)]]))
        rays = [camera.vector_from_pixel(pixel).data[:, 0] for camera in (before, now)]
        angle = np.arcsin(np.linalg.norm(np.cross(turn @ rays[0], rays[1])))
        print(f"{name}: {1e3 * angle:.3f} mrad")


if __name__ == "__main__":
    main(*sys.argv[1:])
