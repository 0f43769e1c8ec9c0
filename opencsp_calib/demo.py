"""A set of photographs as the seed's procedure asks for them, whose camera is known to the last digit."""

import json
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, as_completed
from dataclasses import dataclass
from pathlib import Path

from opencsp_calib.atomic import replacing
from opencsp_calib.board import Board, Checkerboard
from opencsp_calib.camera import Camera
from opencsp_calib.errors import InputError
from opencsp_calib.images import write_image
from opencsp_calib.pose import Pose
from opencsp_calib.rendering import render
from opencsp_calib.synthetic import demo_camera, seed_poses

__all__ = ["DemoWorld", "make_demo"]


@dataclass(frozen=True, eq=False)
class DemoWorld:
    """The truth behind rendered photographs.

    Parameters
    ----------
    images : tuple of Path
        The photographs, in order.
    camera : Camera
        That took them.
    board : Board
    poses : tuple of Pose
        Board to camera, one a photograph.
    """

    images: tuple[Path, ...]
    camera: Camera
    board: Board
    poses: tuple[Pose, ...]


def make_demo(
    folder: str | os.PathLike[str],
    views: int = 50,
    *,
    jobs: int = 1,
    progress: Callable[[int, int], None] | None = None,
) -> DemoWorld:
    """Photographs of a board of 22 x 19 squares of 50 mm, tilted by 30 to 45 degrees, half of them turned upright.

    They are written to the folder as ``001.png`` and so on, one after another, so that memory holds only as many as
    there are jobs; the truth is written beside them as ``truth.json``.

    Parameters
    ----------
    folder : path-like
        Made if it does not exist.
    views : int
    jobs : int
        Threads to work with.
    progress : callable, optional
        Told how many photographs are done, and how many there will be, after each.

    Raises
    ------
    InputError
        If the folder cannot be made or written to.
    MissingDependencyError
        If OpenCV, which writes the images, is not installed.
    """
    if views < 1:
        raise InputError(f"a demo needs at least one view, not {views}")
    folder = Path(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {folder}: {error.strerror}") from None
    board = Checkerboard(21, 18, 0.05)
    camera = demo_camera()
    poses = seed_poses(board, camera, views)
    images = tuple(folder / f"{view:0{max(3, len(str(views)))}d}.png" for view in range(1, views + 1))
    world = DemoWorld(images, camera, board, poses)
    _photograph(world, jobs, progress)
    with replacing(folder / "truth.json") as temporary:
        temporary.write_text(json.dumps(_truth(world), indent=2) + "\n", encoding="utf-8")
    return world


def _photograph(world: DemoWorld, jobs: int, progress: Callable[[int, int], None] | None) -> None:
    def take(view: int) -> None:
        image = render(world.camera, world.board, world.poses[view], rng=view)
        write_image(image.pixels, world.images[view])

    total = len(world.images)
    with ThreadPoolExecutor(jobs) as pool:
        taken = [pool.submit(take, view) for view in range(total)]
        try:
            for done, future in enumerate(as_completed(taken), start=1):
                future.result()
                if progress:
                    progress(done, total)
        except BaseException:  # Ctrl-C too: without this the pool would first finish all that was submitted
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def _truth(world: DemoWorld) -> dict[str, object]:
    camera = world.camera
    return {
        "camera": {
            "name": camera.name,
            "model": camera.model,
            "image_size": list(camera.image_size),
            "params": dict(zip(camera.lens.parameter_names, camera.params.tolist(), strict=True)),
        },
        "board": world.board.spec,
        "views": [
            {
                "image": path.name,
                "board_to_camera": {"rotation_rad": pose.rotation.tolist(), "translation_m": pose.translation.tolist()},
            }
            for path, pose in zip(world.images, world.poses, strict=True)
        ],
    }
