"""The live picture: frames a second and latency of a capture with detection and gauges.

Claim
    At 1626 x 1236 on two cores, the preview runs at 10 frames a second or more, and what is shown is less than 0.3 s
    old.

Way
    Basler's camera emulation sends rendered photographs of an 18 x 23 board at 50 frames a second through the `basler`
    source into a `Capture`, as the command does: a board held still, one that moves, no board at all, and one of which
    a photograph is taken every second, so that the coach learns at the same time. Latency is from when the frame is
    fetched from the camera's buffer, which is of the latest frame and at most 20 ms old, to when it has been looked at,
    judged and handed to the display. Processor time is that of the thread that looks at the frames.

Run ``python validation/bench.py preview``.
"""

import os

os.environ["PYLON_CAMEMU"] = "1"  # read when the SDK is loaded

import tempfile
import time
from datetime import datetime, timezone
from pathlib import Path

import cv2
import numpy as np
from threadpoolctl import threadpool_limits

from opencsp_calib import Checkerboard, Pose
from opencsp_calib.capture import Capture, CaptureFolder, release_from
from opencsp_calib.looking import Search
from opencsp_calib.opencv import opencv_on_one_thread
from opencsp_calib.registry import installed
from opencsp_calib.rendering import render
from opencsp_calib.synthetic import demo_camera, pose_in_view, seed_poses, turned

BOARD, CAMERA = Checkerboard(18, 23, 0.05), demo_camera()
SECONDS = 12.0


def write_frames(folder, poses):
    """A scene for the emulation; no board where there is no pose."""
    for index, pose in enumerate(poses):
        pose = pose or Pose(np.zeros(3), np.array([100.0, 0.0, 3.0]))
        pixels = render(CAMERA, BOARD, pose, rng=index, samples=2).pixels
        cv2.imwrite(str(folder / f"{index:03d}.bmp"), pixels)  # quick to read: the emulation reads each file again


def still(count):
    """One pose."""
    return [pose_in_view(BOARD, CAMERA, turned(0.6, 0.5, 0.0), 0.7)] * count


def moving(count):
    """Across the image."""
    rotation = turned(0.6, 0.5, 0.0)
    return [pose_in_view(BOARD, CAMERA, rotation, 0.6, (part, 0.5)) for part in np.linspace(0, 1, count)]


SCENES = {
    "held still": (still(4), "manual"),
    "moving": (moving(12), "manual"),
    "no board": ([None] * 3, "manual"),
    "small": ([pose_in_view(BOARD, CAMERA, turned(0.6, 0.5, 0.0), 0.3)] * 3, "manual"),
    "learning from a photograph a second": (list(seed_poses(BOARD, CAMERA, 12)), "interval:1"),
}


def measured(poses, release):
    """Frames a second, latencies (N,) s, processor seconds a frame."""
    with tempfile.TemporaryDirectory() as name:
        scene, target = Path(name) / "scene", Path(name) / "set"
        scene.mkdir()
        write_frames(scene, poses)
        registry = installed()
        source = registry.image_source("basler")
        folder = CaptureFolder.opened(target, BOARD.spec, "basler", "")
        search = Search(BOARD, registry.detector("checkerboard"), "model")
        capture = Capture(folder, search, release_from(release), 1000)
        settings = {
            "AcquisitionFrameRate": 50,
            "ImageFilename": str(scene),
            "ImageFileMode": "On",
            "TestImageSelector": "Off",
        }
        latencies, begun = [], []

        def show(state):
            fetched = datetime.fromisoformat(state.moment.glance.image.record["time"])
            latencies.append((datetime.now(timezone.utc) - fetched).total_seconds())
            begun.append((time.perf_counter(), time.thread_time()))
            if begun[-1][0] - begun[0][0] > SECONDS:
                capture.stop()

        with source.open(source.devices()[0], **settings) as images:
            capture.run(images, show)
    wall, processor = (end - start for start, end in zip(begun[2], begun[-1], strict=True))
    frames = len(begun) - 3
    return frames / wall, np.array(latencies[3:]), processor / frames


def main():
    """All scenes."""
    print("| scene | frames a second | latency, median ms | 95 % ms | processor ms a frame |\n|---|---|---|---|---|")
    with threadpool_limits(1), opencv_on_one_thread():
        for name, (poses, release) in SCENES.items():
            rate, latency, processor = measured(poses, release)
            middle, most = 1e3 * np.quantile(latency, [0.5, 0.95])
            print(f"| {name} | {rate:.1f} | {middle:.0f} | {most:.0f} | {1e3 * processor:.0f} |", flush=True)


if __name__ == "__main__":
    main()
