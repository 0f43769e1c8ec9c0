"""Pixel conventions against each program: its own projection of a point, and ours of its file.

Claim
    A camera that came from another program's file projects every point to where that program projects it, to 1e-9 px,
    once the program's pixel origin is taken into account: the centre of the upper-left pixel is (0, 0) for OpenCV,
    mrcal, OpenSfM and us, (0.5, 0.5) for COLMAP and Metashape, (1, 1) for MATLAB. Half a pixel wrong is not within it.

Way
    OpenCV, COLMAP (pycolmap) and mrcal project 500 random points themselves; the file is written by the program where
    it can (OpenCV's FileStorage, COLMAP's text), else by us and read by it (mrcal). MATLAB, Metashape and OpenSfM,
    which cannot run here, are the formulas of their manuals, written down in this file. "Worst" is the largest distance
    in pixels; "if wrong by half" what it would be with half a pixel mistaken.

Run ``python validation/bench.py conventions``.
"""

import json
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np

from opencsp_calib import Camera
from opencsp_calib.arrays import Floats, Pixels, Points
from opencsp_calib.importing import exact, read_cameras
from opencsp_calib.registry import installed

SIZE = (1626, 1236)
CORE = [2710.5, 2701.7, 829.6, 626.3]
DISTORTIONS = {
    "pinhole": [],
    "opencv4": [-0.17, 0.19, 6e-4, -5e-4],
    "opencv5": [-0.17, 0.19, 6e-4, -5e-4, -0.03],
    "opencv8": [0.3, 0.05, 6e-4, -5e-4, 0.01, 0.47, 0.03, 0.01],
    "opencv12": [0.3, 0.05, 6e-4, -5e-4, 0.01, 0.47, 0.03, 0.01, 1e-3, -2e-4, 5e-4, 1e-4],
    "opencv14": [0.3, 0.05, 6e-4, -5e-4, 0.01, 0.47, 0.03, 0.01, 1e-3, -2e-4, 5e-4, 1e-4, 0.02, -0.01],
    "opencv_fisheye": [0.02, -0.01, 3e-3, -1e-3],
}
OPENCV = tuple(DISTORTIONS)[1:6]
MRCAL = """
import sys, numpy as np, mrcal
model = mrcal.cameramodel(sys.argv[1])
np.save(sys.argv[3], mrcal.project(np.load(sys.argv[2]), *model.intrinsics()))
"""
Case = tuple[str, str, Path, Pixels]


def camera_of(model: str) -> Camera:
    """The camera that all programs are given."""
    return Camera("camera", model, np.array([*CORE, *DISTORTIONS[model]]), SIZE)


def points() -> Points:
    """Points all over the image and at all distances."""
    rng = np.random.default_rng(0)
    plane = rng.uniform([-0.28, -0.21], [0.28, 0.21], (500, 2))
    return np.column_stack([plane, np.ones(500)]) * rng.uniform(0.3, 30.0, (500, 1))


def opencv(folder: Path, seen: Points) -> Iterator[Case]:
    """FileStorage, written and projected by OpenCV."""
    for model in (*OPENCV, "opencv_fisheye"):
        camera, path = camera_of(model), folder / f"{model}.yml"
        fisheye = model == "opencv_fisheye"
        storage = cv2.FileStorage(str(path), cv2.FILE_STORAGE_WRITE)
        storage.write("image_width", SIZE[0])
        storage.write("image_height", SIZE[1])
        storage.write("camera_matrix", camera.matrix)
        storage.write("distortion_coefficients", camera.distortion)
        if fisheye:
            storage.write("fisheye_model", 1)
        storage.release()
        zero = np.zeros(3)
        if fisheye:
            pixels = cv2.fisheye.projectPoints(seen[:, None], zero, zero, camera.matrix, camera.distortion)[0]
        else:
            pixels = cv2.projectPoints(seen, zero, zero, camera.matrix, camera.distortion)[0]
        yield f"OpenCV {cv2.__version__}", model, path, pixels.reshape(-1, 2)


def colmap(folder: Path, seen: Points) -> Iterator[Case]:
    """``cameras.txt``, written and projected by COLMAP."""
    import pycolmap

    theirs = {
        "pinhole": "PINHOLE",
        "opencv4": "OPENCV",
        "opencv8": "FULL_OPENCV",
        "opencv_fisheye": "OPENCV_FISHEYE",
    }
    for model, name in theirs.items():
        params = camera_of(model).params + np.isin(np.arange(4 + len(DISTORTIONS[model])), (2, 3)) * 0.5
        camera = pycolmap.Camera(camera_id=1, model=name, width=SIZE[0], height=SIZE[1], params=params)
        reconstruction = pycolmap.Reconstruction()
        reconstruction.add_camera(camera)
        (folder / model).mkdir()
        reconstruction.write_text(str(folder / model))
        yield f"pycolmap {pycolmap.__version__}", model, folder / model / "cameras.txt", camera.img_from_cam(seen) - 0.5


def mrcal(folder: Path, seen: Points) -> Iterator[Case]:
    """A ``.cameramodel`` of ours, read and projected by mrcal in Debian's Python."""
    solver = installed().solvers["mrcal"]
    if solver.missing():
        print(f"mrcal is left out: {solver.missing()}\n")
        return
    np.save(folder / "points.npy", seen)
    for model in ("pinhole", "opencv4", "opencv5", "opencv8", "opencv12"):
        path, found = folder / f"{model}.cameramodel", folder / f"{model}.npy"
        installed().camera_formats["mrcal"].write({"camera": camera_of(model)}, path)
        subprocess.run(["/usr/bin/python3", "-c", MRCAL, path, folder / "points.npy", found], check=True)
        yield f"mrcal {solver.version()}", model, path, np.load(found)


def matlab(folder: Path, seen: Points) -> Iterator[Case]:
    """MATLAB's documentation of cameraParameters: OpenCV's distortion, and a first pixel whose centre is (1, 1)."""
    k1, k2, p1, p2, k3 = DISTORTIONS["opencv5"]
    fx, fy, cx, cy = CORE
    matrix = [[fx, 0, cx + 1], [0, fy, cy + 1], [0, 0, 1]]
    content = {"K": matrix, "RadialDistortion": [k1, k2, k3], "TangentialDistortion": [p1, p2]}
    path = folder / "matlab.json"
    path.write_text(json.dumps(content | {"ImageSize": [SIZE[1], SIZE[0]]}))
    x, y = (seen[:, :2] / seen[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + (cx + 1)
    v = fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + (cy + 1)
    yield "MATLAB (formula)", "opencv5", path, np.column_stack([u, v]) - 1


def metashape(folder: Path, seen: Points) -> Iterator[Case]:
    """Appendix "Camera models" of Metashape's manual: origin in the image's corner, P1 and P2 changed over."""
    f, cx, cy, b1 = 2701.7, 17.1, 8.8, 8.8
    k1, k2, k3, p1, p2 = -0.17, 0.19, -0.03, 4e-4, -7e-4
    values = {"f": f, "cx": cx, "cy": cy, "b1": b1, "k1": k1, "k2": k2, "k3": k3, "p1": p1, "p2": p2}
    fields = {"projection": "frame", "width": SIZE[0], "height": SIZE[1], **values}
    path = folder / "metashape.xml"
    inside = "".join(f"<{key}>{value}</{key}>" for key, value in fields.items())
    path.write_text(f"<?xml version='1.0' encoding='UTF-8'?><calibration>{inside}</calibration>")
    x, y = (seen[:, :2] / seen[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    xd = x * radial + p1 * (r2 + 2 * x * x) + 2 * p2 * x * y
    yd = y * radial + p2 * (r2 + 2 * y * y) + 2 * p1 * x * y
    u, v = SIZE[0] / 2 + cx + xd * f + xd * b1, SIZE[1] / 2 + cy + yd * f
    yield "Metashape (formula)", "opencv5", path, np.column_stack([u, v]) - 0.5


def opensfm(folder: Path, seen: Points) -> Iterator[Case]:
    """OpenSfM's documentation: everything over the larger side, from the middle between first and last pixel centre."""
    width, height = SIZE
    fx, fy, cx, cy, k1, k2, k3, p1, p2 = 1.66, 1.65, 0.01, -0.007, -0.17, 0.19, -0.03, 6e-4, -5e-4
    names = ("focal_x", "focal_y", "c_x", "c_y", "k1", "k2", "k3", "p1", "p2")
    content = dict(zip(names, (fx, fy, cx, cy, k1, k2, k3, p1, p2), strict=True))
    path = folder / "cameras.json"
    path.write_text(json.dumps({"camera": {"projection_type": "brown", "width": width, "height": height} | content}))
    x, y = (seen[:, :2] / seen[:, 2:]).T
    r2 = x * x + y * y
    radial = 1 + k1 * r2 + k2 * r2**2 + k3 * r2**3
    u = fx * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + cx
    v = fy * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + cy
    middle = np.array([width - 1, height - 1]) / 2
    yield "OpenSfM (formula)", "opencv5", path, np.column_stack([u, v]) * width + middle


PROGRAMS: tuple[Callable[[Path, Points], Iterator[Case]], ...] = (opencv, colmap, mrcal, matlab, metashape, opensfm)


def worst(theirs: Floats, ours: Floats) -> float:
    """Largest distance, px."""
    return float(np.linalg.norm(theirs - ours, axis=1).max())


def main() -> None:
    """Print the table."""
    seen = points()
    print("| program | lens model | worst px | if wrong by half |\n|---|---|---|---|")
    for program in PROGRAMS:
        with tempfile.TemporaryDirectory() as folder:
            for name, model, path, theirs in program(Path(folder), seen):
                cameras = read_cameras(path, installed().camera_formats)
                # four coefficients of OpenCV may be a fisheye's, too: then it is two cameras, named by their model
                camera = exact(cameras[model] if len(cameras) > 1 else next(iter(cameras.values())))
                assert camera.model == model, f"{name}: {camera.model}, expected {model}"
                ours = camera.project(seen)
                print(f"| {name} | {model} | {worst(theirs, ours):.1e} | {worst(theirs, ours + 0.5):.2f} |", flush=True)


if __name__ == "__main__":
    main()
