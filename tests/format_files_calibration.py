"""The same as `format_files`, of programs that calibrate: OpenCV and its kin, MATLAB, COLMAP, mrcal, and our own."""

import io
import json
import struct
import tempfile
from collections.abc import Mapping
from pathlib import Path

import h5py
import numpy as np
from matlab_files import hdf5, object_file, structures

__all__ = ["FILES", "HDF5_FILES"]

K = [[900.5, 0.0, 502.0], [0.0, 901.5, 398.5], [0.0, 0.0, 1.0]]
D = [-0.1, 0.02, 0.001, -0.002, -0.003]


def in_json(content: object) -> bytes:
    """As a file has it."""
    return json.dumps(content).encode()


OPENCV_YAML = b"""%YAML:1.0
---
calibration_time: "Sun 01 Nov 2026"
image_width: 1000
image_height: 800
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 9.0050000000000000e+02, 0., 502., 0., 901.5, 398.5, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -1.e-01, 2.e-02, 1.e-03, -2.e-03, -3.e-03 ]
avg_reprojection_error: .Nan
"""

OPENCV_XML = b"""<?xml version="1.0"?>
<opencv_storage>
<M1 type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
  <data>900.5 0. 502. 0. 901.5 398.5 0. 0. 1.</data></M1>
<D1 type_id="opencv-matrix"><rows>1</rows><cols>5</cols><dt>d</dt>
  <data>-0.1 0.02 0.001 -0.002 -0.003</data></D1>
<M2 type_id="opencv-matrix"><rows>3</rows><cols>3</cols><dt>d</dt>
  <data>900.5 0. 502. 0. 901.5 398.5 0. 0. 1.</data></M2>
<D2 type_id="opencv-matrix"><rows>1</rows><cols>4</cols><dt>d</dt>
  <data>-0.1 0.02 0.001 -0.002</data></D2>
<imageSize>1000 800</imageSize>
<!-- flags -->
</opencv_storage>
"""

ROS = b"""image_width: 1000
image_height: 800
camera_name: left
camera_matrix:
  rows: 3
  cols: 3
  data: [900.5, 0, 502, 0, 901.5, 398.5, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.1, 0.02, 0.001, -0.002, -0.003]
binning_x: 2
binning_y: 2
roi: {x_offset: 10, y_offset: 20, height: 700, width: 800, do_rectify: false}
"""

ROS_INI = b"""[image]

width
1000

height
800

[left]

camera matrix
900.5 0 502
0 901.5 398.5
0 0 1

distortion
-0.1 0.02 0.001 -0.002 -0.003
"""

KALIBR = b"""cam0:
  camera_model: pinhole
  distortion_coeffs: [-0.1, 0.02, 0.001, -0.002]
  distortion_model: radtan
  intrinsics: [900.5, 901.5, 502.0, 398.5]
  resolution: [1000, 800]
cam1:
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.2]
  camera_model: ds
  distortion_coeffs: []
  distortion_model: none
  intrinsics: [-0.2, 0.6, 317.5, 316.0, 502.0, 398.5]
  resolution: [1000, 800]
"""

COLMAP = b"""# Camera list
1 OPENCV 1000 800 900.5 901.5 502.5 399 -0.1 0.02 0.001 -0.002
2 FOV 1000 800 900.5 901.5 502.5 399 0.9
"""
COLMAP_BIN = struct.pack("<QIiQQ4d", 2, 1, 1, 1000, 800, 900.5, 901.5, 502.5, 399.0)
COLMAP_BIN += struct.pack("<IiQQ5d", 2, 7, 1000, 800, 900.5, 901.5, 502.5, 399.0, 0.9)

MRCAL = b"""# a comment
{
    'lensmodel':  'LENSMODEL_CAHVOR',
    'intrinsics': [ 900.5, 901.5, 502., 398.5, 0.01, -0.02, 0.02, -0.01, 3e-3,],
    'extrinsics': [ 0., 0., 0., 0., 0., 0.,],
    'imagersize': [ 1000, 800 ],
    'optimization_inputs': b'''a]}b#'''
}
"""

CAHVOR = b"""Dimensions = 1000 800
Model = CAHVOR = perspective, distortion
C = 0.0 0.0 0.0
A = 0.0 0.0 1.0
H = 900.5 0.0 502.0
V = 0.0 901.5 398.5
O = 0.0998334166 0.0 0.9950041653
R = 0.02 -0.01 0.003
"""

BOUGUET = b"""%-- Focal length:
fc = [ 900.500000000000000 ; 901.500000000000000 ];
cc = [ 502.000000000000000 ; 398.500000000000000 ];
alpha_c = 0.000000000000000;
kc = [ -0.1 ; 0.02 ; 0.001 ; -0.002 ; -0.003 ];
nx = 1000;
ny = 800;
"""

MATLAB = {
    "RadialDistortion": np.array([[-0.1, 0.02, -0.003]]),
    "TangentialDistortion": np.array([[0.001, -0.002]]),
    "ImageSize": np.array([[800.0, 1000.0]]),
    "IntrinsicMatrix": np.transpose(K),
}
OBJECT = object_file([np.zeros((8, 1), np.uint8), MATLAB], {"params": "cameraParameters"}, compress=False)
MATLAB_JSON = in_json({key: value.tolist() for key, value in MATLAB.items()})
FISHEYE = {
    "MappingCoefficients": [[350.0, -1.1e-3, 4e-7, -6e-10]],
    "DistortionCenter": [[512.0, 398.0]],
    "StretchMatrix": np.eye(2),
    "ImageSize": [[800, 1000]],
}
BOUGUET_MAT = structures(
    {"fc": [[900.5], [901.5]], "cc": [[502.0], [398.5]], "kc": np.array(D)[:, None], "nx": 1000.0, "ny": 800.0}
)


def _hdf5() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        return hdf5(Path(folder) / "a.mat", {"p": MATLAB}).read_bytes()


def _opencsp() -> bytes:
    """A camera file as OpenCSP writes it."""
    buffer = io.BytesIO()
    with h5py.File(buffer, "w") as file:
        file["Camera/intrinsic_mat"] = np.array(K)
        file["Camera/distortion_coef"] = np.array(D)
        file["Camera/image_shape_xy"] = np.array([1000, 800])
        file["Camera/name"] = "a"
    return buffer.getvalue()


FILES: Mapping[str, Mapping[str, bytes]] = {
    "opencv": {
        "camera.yml": OPENCV_YAML,
        "stereo.xml": OPENCV_XML,
        "plain.json": in_json({"K": K, "D": D}),
    },
    "ros": {"ost.yaml": ROS},
    "ros-ini": {"ost.ini": ROS_INI},
    "kalibr": {"camchain.yaml": KALIBR},
    "colmap": {"cameras.txt": COLMAP},
    "colmap-bin": {"cameras.bin": COLMAP_BIN},
    "mrcal": {"a.cameramodel": MRCAL},
    "cahvor": {"a.cahvor": CAHVOR},
    "bouguet": {"Calib_Results.m": BOUGUET, "Calib_Results.mat": BOUGUET_MAT},
    "matlab": {"object.mat": OBJECT, "fisheye.mat": structures({"f": FISHEYE}), "params.json": MATLAB_JSON},
}
HDF5_FILES = {"matlab": _hdf5, "opencsp": _opencsp}
"""Made when asked for; they are long, and their library is not ours to test byte by byte."""
