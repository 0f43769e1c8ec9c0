"""Folders of rendered photographs, for the studies of what is done with files."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from opencsp_calib import Board, Camera, Pose
from opencsp_calib.images import write_image
from opencsp_calib.rendering import render


def write_photographs(folder: Path, camera: Camera, board: Board, poses: Sequence[Pose], first_seed: int = 0) -> None:
    """Render the board in each pose as ``0000.png``, ``0001.png`` ..., each with noise of its own.

    Parameters
    ----------
    folder : Path
        Made where it is not there.
    camera, board, poses
        What is photographed.
    first_seed : int
        Of the noise of the first photograph; that of the next ones is larger by one each.
    """
    folder.mkdir(exist_ok=True)

    def write(index: int) -> None:
        write_image(render(camera, board, poses[index], rng=first_seed + index).pixels, folder / f"{index:04d}.png")

    with ThreadPoolExecutor(2) as pool:
        list(pool.map(write, range(len(poses))))
