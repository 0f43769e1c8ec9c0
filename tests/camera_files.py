"""What tests write into camera files, and whether two files are the same."""

from pathlib import Path

import h5py
import numpy as np

from opencsp_calib import (
    Camera,
    CharucoBoard,
    Checkerboard,
    Detection,
    Observations,
    Problem,
    RejectedCorner,
    View,
)
from opencsp_calib.board import Board, RecordedBoard
from opencsp_calib.models import LENS_MODELS

PARAMS = [2710.1, 2704.3, 854.2, 628.1]


def camera_of(model: str) -> Camera:
    distortion = np.linspace(0.01, 0.02, len(LENS_MODELS[model].distortion_names))
    return Camera("Bäsler a|b 📷", model, np.concatenate([PARAMS, distortion]), (1626, 1236))


BOARDS = (
    Checkerboard(5, 4, 0.05),
    CharucoBoard(5, 4, 0.05, 0.03, "DICT_4X4_50", inverted=True),
    RecordedBoard(5, 4, 0.05, "dots:5x4:50mm"),
)


def observations(board: Board) -> Observations:
    rng = np.random.default_rng(3)
    count = len(board.points)

    def detection(covariance: bool) -> Detection:
        return Detection(
            rng.permutation(count)[: count - 1],
            rng.uniform(0, 1200, (count - 1, 2)),
            covariance=np.tile(np.eye(2) * 0.01, (count - 1, 1, 1)) if covariance else None,
            edge_width_px=rng.uniform(0.5, 2, count - 1) if covariance else None,
            rejected=(RejectedCorner(3, (1.5, 2.5), "glare"),),
            reason="partly hidden",
        )

    views = (
        View("a/1.png", detection(True), "used", (Problem("x", "y"),), "ab12"),
        View("a/2.png", Detection.nothing("no board here"), "no board"),
        View("ü 3.png", detection(False), "used"),
    )
    return Observations(board, (1626, 1236), views)


def assert_same_files(one: Path, other: Path) -> None:
    """The same of everything, but for where and when it was made."""
    first, second = _content(one), _content(other)
    assert first.keys() == second.keys()
    for name in first:
        np.testing.assert_array_equal(first[name], second[name], err_msg=name)


def _content(path: Path) -> dict[str, object]:
    values: dict[str, object] = {}
    with h5py.File(path) as file:
        file.visititems(lambda name, item: values.update({name: item[()]}) if isinstance(item, h5py.Dataset) else None)
        values |= {f"Camera@{name}": value for name, value in file["Camera"].attrs.items()}
    del values["Calibration/provenance"]
    return values
