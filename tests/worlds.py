"""A small world with a known answer, for tests that go all the way from photographs to a camera file."""

from dataclasses import dataclass
from pathlib import Path

from opencsp_calib import Board, Camera, Checkerboard, Pose
from opencsp_calib.images import write_image
from opencsp_calib.rendering import render
from opencsp_calib.synthetic import seed_poses


@dataclass(frozen=True)
class SmallWorld:
    """Camera, board, and where the board was."""

    camera: Camera
    board: Board
    poses: tuple[Pose, ...]
    spec: str = "checkerboard:9x6:30mm"

    @classmethod
    def seeded(cls, views: int = 12) -> "SmallWorld":
        camera = Camera("small", "opencv4", [800.0, 800.0, 330.0, 236.0, -0.12, 0.05, 1e-3, -5e-4], (640, 480))
        board = Checkerboard(9, 6, 0.03)
        return cls(camera, board, seed_poses(board, camera, views, rng=7))

    def photograph(self, folder: Path) -> None:
        for index, pose in enumerate(self.poses):
            write_image(render(self.camera, self.board, pose, rng=index).pixels, folder / f"{index + 1:02d}.png")
