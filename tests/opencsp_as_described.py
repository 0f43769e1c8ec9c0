"""OpenCSP's Camera as its documentation describes it, for tests where OpenCSP is not installed.

Written from the description of `opencsp.common.lib.camera.Camera` and of `hdf5_tools`: the loader squeezes arrays,
flattens single values and decodes bytes; rays come from `cv2.undistortPoints`.
"""

from pathlib import Path

import cv2
import h5py
import numpy as np

DATASETS = ("intrinsic_mat", "distortion_coef", "image_shape_xy", "name")


class Vxy:
    """Points (2, N)."""

    def __init__(self, data) -> None:
        self.data = np.asarray(data, dtype=np.float64)


class Camera:
    """Intrinsics as SOFAST uses them."""

    def __init__(self, intrinsic_mat, distortion_coef, image_shape_xy, name) -> None:
        self.intrinsic_mat = intrinsic_mat
        self.distortion_coef = distortion_coef
        self.image_shape_xy = image_shape_xy
        self.name = name

    @classmethod
    def load_from_hdf(cls, file: str | Path) -> "Camera":
        loaded = {}
        with h5py.File(file, "r") as content:
            for name in DATASETS:
                data = content[f"Camera/{name}"]
                value = (
                    data[()] if data.ndim == 0 else data[...].flatten()[0] if data.size == 1 else data[...].squeeze()
                )
                loaded[name] = value.decode() if isinstance(value, bytes) else value
        return cls(**loaded)

    def vector_from_pixel(self, pixels: Vxy) -> Vxy:
        plane = cv2.undistortPoints(pixels.data.T.reshape(-1, 1, 2), self.intrinsic_mat, self.distortion_coef)[:, 0]
        rays = np.column_stack([plane, np.ones(len(plane))])
        return Vxy((rays / np.linalg.norm(rays, axis=1, keepdims=True)).T)
