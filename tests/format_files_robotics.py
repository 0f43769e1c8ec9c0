"""The same as `format_files`, of programs for robots, motion capture and machine vision."""

from collections.abc import Mapping

from format_files_calibration import in_json

CALIBIO = {
    "calibration": {
        "cameras": [
            {
                "model": {
                    "polymorphic_id": 2147483649,
                    "polymorphic_name": "libCalib::CameraModelOpenCV",
                    "ptr_wrapper": {
                        "data": {
                            "CameraModelCRT": {"CameraModelBase": {"imageSize": {"width": 1000, "height": 800}}},
                            "parameters": {
                                key: {"val": value, "state": 2}
                                for key, value in {
                                    "f": 900.5,
                                    "ar": 1.001,
                                    "cx": 502.0,
                                    "cy": 398.5,
                                    "k1": -0.1,
                                    "k2": 0.02,
                                    "k3": -0.003,
                                    "p1": 0.001,
                                    "p2": -0.002,
                                }.items()
                            },
                        }
                    },
                }
            }
        ]
    }
}

BASALT = {
    "value0": {
        "intrinsics": [
            {
                "camera_type": "kb4",
                "intrinsics": {
                    "fx": 380,
                    "fy": 381,
                    "cx": 502,
                    "cy": 398,
                    "k1": 0.01,
                    "k2": -0.02,
                    "k3": 0.003,
                    "k4": 0,
                },
            },
            {
                "camera_type": "ds",
                "intrinsics": {"fx": 158, "fy": 159, "cx": 502, "cy": 398, "xi": -0.17, "alpha": 0.59},
            },
        ],
        "resolution": [[1000, 800], [1000, 800]],
    }
}

CAMODOCAL = b"""%YAML:1.0
model_type: MEI
camera_name: camera
image_width: 1000
image_height: 800
mirror_parameters:
   xi: 1.2
distortion_parameters:
   k1: -1e-1
   k2: 2.e-02
   p1: 0.001
   p2: -0.002
projection_parameters:
   gamma1: 900.5
   gamma2: 901.5
   u0: 502.0
   v0: 398.5
extrinsicRotation: !!opencv-matrix
   rows: 1
   cols: 1
   dt: d
   data: [ 0 ]
"""

BOOFCV = b"""# Pinhole camera model
model: pinhole_radial_tangential
pinhole:
  fx: 900.5
  fy: 901.5
  cx: 502.5
  cy: 399.0
  width: 1000
  height: 800
  skew: 0.0
radial_tangential:
  radial:
  - -0.1
  - 0.02
  t1: 0.001
  t2: -0.002
"""

CALISCOPE = b"""[cameras.3]
cam_id = 3
rotation_count = 0
size = [1000, 800]
matrix = [[900.5, 0.0, 502.0], [0.0, 901.5, 398.5], [0.0, 0.0, 1.0]]
distortions = [-0.1, 0.02, 0.001, -0.002, -0.003]
"""

ANIPOSELIB = b"""[cam_0]
name = "left"
size = [ 1000, 800,]
matrix = [ [ 900.5, 0.0, 502.0,], [ 0.0, 901.5, 398.5,], [ 0.0, 0.0, 1.0,],]
distortions = [ -0.1, 0.02, 0.001, -0.002, -0.003,]
rotation = [ 0.1, 0.2, 0.3,]
[metadata]
"""

MULTICAL = {
    "cameras": {
        "left": {
            "model": "standard",
            "image_size": [1000, 800],
            "K": [[900.5, 0, 502.0], [0, 901.5, 398.5], [0, 0, 1]],
            "dist": [[-0.1, 0.02, 0.001, -0.002, -0.003]],
        }
    },
    "camera_poses": {"left": {}},
}

HALCON = b"""# INTERNAL CAMERA PARAMETERS
ParGroup: Camera: Parameter;
  "Internal camera parameters";
Focus:foc:      9.0e-03;
  DOUBLE:0.0:;
  "Focal length of the lens [meter]";
Kappa:kappa:   -1200.0;
  DOUBLE::;
  "Kappa";
Sx:sx:   1.0e-05;
Sy:sy:   1.0e-05;
Cx:cx:   502.0;
Cy:cy:   398.5;
ImageWidth:imgw:  1000;
  INT:1:32768;
ImageHeight:imgh:  800;
"""

TSAI = b"""VERSION_4
PINHOLE
fu = 9.005
fv = 9.015
cu = 5.02
cv = 3.985
u_direction = 1  0  0
v_direction = 0  1  0
w_direction = 0  0  1
C = 266.943 -105.583 -2.14189
R = 1 0 0 0 1 0 0 0 1
pitch = 0.01
TSAI
k1 = -0.1
k2 = 0.02
p1 = 0.001
p2 = -0.002
k3 = -0.003
"""

FILES: Mapping[str, Mapping[str, bytes]] = {
    "calibio": {"project.json": in_json(CALIBIO)},
    "basalt": {"calibration.json": in_json(BASALT)},
    "camodocal": {"camera.yaml": CAMODOCAL},
    "boofcv": {"intrinsic.yaml": BOOFCV},
    "caliscope": {"camera_array.toml": CALISCOPE},
    "aniposelib": {"calibration.toml": ANIPOSELIB},
    "multical": {"calibration.json": in_json(MULTICAL)},
    "halcon": {"campar.dat": HALCON},
    "tsai": {"camera.tsai": TSAI},
}
