"""The same as `format_files`, of programs that make models of the world from photographs."""

from collections.abc import Mapping

from format_files_calibration import in_json

METASHAPE = b"""<?xml version="1.0" encoding="UTF-8"?>
<calibration>
  <projection>frame</projection>
  <width>1000</width>
  <height>800</height>
  <f>900.5</f>
  <cx>3.25</cx>
  <cy>-2.5</cy>
  <b1>1.5</b1>
  <k1>-0.1</k1>
  <k2>0.02</k2>
  <k3>-0.003</k3>
  <p1>0.0004</p1>
  <p2>-0.0002</p2>
</calibration>
"""

METASHAPE_CHUNK = b"""<document version="2.0.0"><chunk label="Chunk 1"><sensors>
<sensor id="0" label="a" type="frame"><resolution width="1000" height="800"/>
<calibration type="frame" class="adjusted"><resolution width="1000" height="800"/><f>900.5</f><k1>-0.1</k1>
</calibration>
</sensor><sensor id="1" label="a" type="fisheye"><resolution width="1000" height="800"/>
<calibration type="fisheye" class="initial"><f>400</f><k1>0.01</k1></calibration></sensor>
<sensor id="2" label="c" type="frame"><resolution width="1000" height="800"/></sensor>
</sensors></chunk></document>
"""

OPENSFM = {
    "cam one": {
        "projection_type": "brown",
        "width": 1000,
        "height": 800,
        "focal_x": 0.9,
        "focal_y": 0.91,
        "c_x": 0.01,
        "c_y": -0.02,
        "k1": -0.1,
        "k2": 0.02,
        "p1": 0.001,
        "p2": -0.002,
        "k3": -0.003,
    }
}

ALICEVISION = {
    "version": ["1", "2", "11"],
    "intrinsics": [
        {
            "intrinsicId": "7",
            "width": "1000",
            "height": "800",
            "sensorWidth": "36",
            "type": "pinhole",
            "initializationMode": "estimated",
            "focalLength": "32.4",
            "pixelRatio": "1",
            "principalPoint": ["3.5", "-2.25"],
            "distortionParams": ["-0.1", "0.02", "-0.003", "0.001", "-0.002"],
            "distortionType": "brown",
            "undistortionType": "none",
            "locked": "false",
        }
    ],
}

TRANSFORMS = {
    "fl_x": 900.5,
    "fl_y": 901.5,
    "cx": 502.0,
    "cy": 398.5,
    "w": 1000,
    "h": 800,
    "k1": -0.1,
    "k2": 0.02,
    "p1": 0.001,
    "p2": -0.002,
    "frames": [{"file_path": "a.jpg"}, {"file_path": "b.jpg"}],
}

BUNDLER = b"""# Bundle file v0.3
2 0
9.0e+02 -1.0e-01 2.0e-02
1 0 0
0 1 0
0 0 1
0 0 0
0 0 0
0 0 0
0 0 0
0 0 0
0 0 0
"""

NVM = b"""NVM_V3

2
a b.jpg 900.5 1 0 0 0 0 0 0 0 0
c.jpg 900.5 1 0 0 0 0 0 0 -0.1 0
"""

REALITYCAPTURE = b"""<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">
<rdf:Description xmlns:xcr="http://www.capturingreality.com/ns/xcr/1.1#" xcr:Version="3" xcr:DistortionModel="brown3t2"
 xcr:DistortionCoeficients="-0.1 0.02 -0.003 0 0.001 -0.002" xcr:FocalLength35mm="32.4" xcr:Skew="0" xcr:AspectRatio="1"
 xcr:PrincipalPointU="0.002" xcr:PrincipalPointV="-0.003" xcr:CalibrationPrior="exact">
<xcr:Position>1 2 3</xcr:Position></rdf:Description></rdf:RDF></x:xmpmeta>
"""

PIX4D_CAM = b"""Pix4D camera calibration file 0
#Focal Length mm assuming a sensor width of 10.00x8.00mm
F 9.0
#Principal Point mm
Px 5.1
Py 3.9
#Symmetrical Lens Distortion Coeffs
K1 -0.1
K2 0.02
K3 -0.003
#Tangential Lens Distortion Coeffs
T1 0.001
T2 -0.002
"""

PIX4D_TXT = b"""fileName imageWidth imageHeight
camera matrix K [3x3]
radial distortion [3x1]
tangential distortion [2x1]
camera position t [3x1]
camera rotation R [3x3]
camera model m = K [R|-Rt] X

a b.JPG 1000 800
900.5 0 502.5
0 901.5 398.5
0 0 1
-0.1 0.02 -0.003
0.001 -0.002
1 2 3
1 0 0
0 1 0
0 0 1
"""

OPENMVG = {
    "sfm_data_version": "0.3",
    "intrinsics": [
        {
            "key": 0,
            "value": {
                "polymorphic_id": 2147483649,
                "polymorphic_name": "pinhole_brown_t2",
                "ptr_wrapper": {
                    "id": 2147483660,
                    "data": {
                        "width": 1000,
                        "height": 800,
                        "focal_length": 900.5,
                        "principal_point": [502.0, 398.5],
                        "disto_t2": [-0.1, 0.02, -0.003, 0.001, -0.002],
                    },
                },
            },
        }
    ],
    "extrinsics": [{"key": 0}],
}

FILES: Mapping[str, Mapping[str, bytes]] = {
    "metashape": {"lens.xml": METASHAPE, "cameras.xml": METASHAPE_CHUNK},
    "opensfm": {"cameras.json": in_json(OPENSFM), "reconstruction.json": in_json([{"cameras": OPENSFM}])},
    "alicevision": {"cameras.sfm": in_json(ALICEVISION)},
    "transforms_json": {"transforms.json": in_json(TRANSFORMS)},
    "bundler": {"bundle.out": BUNDLER},
    "nvm": {"model.nvm": NVM},
    "realitycapture": {"photo.xmp": REALITYCAPTURE},
    "pix4d": {"internal.cam": PIX4D_CAM, "parameters.txt": PIX4D_TXT},
    "openmvg": {"sfm_data.json": in_json(OPENMVG)},
}
