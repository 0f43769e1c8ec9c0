"""Boards of which a part is out of view or covered: what can be told of them, and that nothing wrong is told.

Claim
    A checkerboard of which a part is seen gives the corners that can be told for certain, and no wrong ones; a ChArUco
    board gives about all corners in view, and no wrong ones.

Way
    Random boards rendered at 800 x 600 in a cluttered room, partly out of view, or behind two round things. Wrong ids:
    a corner more than 8 px from its place, in the best of the turns after which the board looks the same. Off: more
    than 2 px, from where the fit may not find home. calib-targets and `findChessboardCornersSBWithMeta` (3 x 3, larger,
    exhaustive) do not say which of the board's corners theirs are. OpenCV's ChArUco: `CharucoDetector` with its
    defaults. Times are of the processor, with one thread.

Run ``python validation/bench.py detection_parts``. It needs calib-targets: ``pip install --group studies``.
"""

import sys
import time
from collections.abc import Callable
from pathlib import Path

import cv2
import numpy as np
from calib_targets import detect_chessboard
from opencsp_calib_opencv.board_kinds import CharucoKind, opencv_board
from opencsp_calib_opencv.charuco import CharucoDetector
from opencsp_calib_opencv.checkerboard import CheckerboardDetector

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from board_photographs import NEAR_PX, Photograph

from opencsp_calib import CharucoBoard, Checkerboard, InputError
from opencsp_calib.rendering import Exposure, Scene, Spot

PARTS, CHARUCOS = 300, 150
WRONG_PX = 8.0


def random_part(rng: np.random.Generator, covered: bool, make: Callable[..., Photograph | None]) -> Photograph | None:
    """A photograph of a board partly out of view or covered; None where there is none."""
    spots = tuple(Spot(*rng.uniform(0, [800, 600]), rng.uniform(10, 140), rng.uniform(0, 255)) for _ in range(2))
    how = {
        "tilt_deg": rng.uniform(0, 50), "azimuth_deg": rng.uniform(0, 360), "roll_deg": rng.uniform(-180, 180),
        "fill": rng.uniform(0.5, 0.95), "scene": Scene(occluders=spots if covered else (), room=int(rng.integers(99))),
        "shift": (0.0, 0.0) if covered else tuple(rng.uniform(-0.4, 0.4, 2)),
        "exposure": Exposure(psf_px=rng.uniform(0.3, 1.5), noise=rng.uniform(0.5, 6)),
    }  # fmt: skip
    try:
        photograph = make(**how)
    except InputError:
        return None
    return photograph if np.isfinite(photograph.pixels).all() else None


def checkerboard_parts() -> None:
    """Boards seen in part."""
    print(
        f"\n### Parts of plain checkerboards\n\n{PARTS} random boards (3 to 15 corners each way, 800 x 600) partly out "
        "of view, as many with two round things before them; views by what ours gives of them, the wrong among these: "
        "wrong ids, or a corner more than 2 px off. Then corners given, in all.\n"
    )
    print("| | views | whole | part | none | wrong ids | corner off | corners | SBWithMeta's | calib-targets' |")
    print("|---|---|---|---|---|---|---|---|---|---|")
    for covered in (False, True):
        rng = np.random.default_rng(7)
        count = dict.fromkeys(("views", "whole", "part", "none", "wrong ids", "off", "ours", "sb", "ct"), 0)
        for _ in range(PARTS):
            board = Checkerboard(*(int(n) for n in rng.integers(3, 16, 2)), 0.05)
            view = random_part(rng, covered, lambda b=board, **how: Photograph.of(b, **how))
            if view is None:
                continue
            detection = CheckerboardDetector().detect(view.image, board)
            count["views"] += 1
            count["ours"] += len(detection)
            whole = len(detection) == len(board.points)
            count["whole" if whole else "part" if len(detection) else "none"] += 1
            off = view.farthest_alike_px(detection)
            count["wrong ids" if off > WRONG_PX else "off"] += off > NEAR_PX
            flags = cv2.CALIB_CB_LARGER + cv2.CALIB_CB_EXHAUSTIVE
            found, corners, _ = cv2.findChessboardCornersSBWithMeta(view.image.pixels, (3, 3), flags)
            count["sb"] += len(corners) if found else 0
            count["ct"] += len(seen.corners) if (seen := detect_chessboard(view.image.pixels)) else 0
        print(f"| {'covered' if covered else 'out of view'} | " + " | ".join(str(n) for n in count.values()) + " |")


def charuco_parts() -> None:
    """ChArUco boards, whole and in part, beside OpenCV."""
    print(
        f"\n### ChArUco\n\n{CHARUCOS} random boards each (3 to 13 squares each way, four dictionaries, some inverted, "
        "some legacy, 800 x 600). Wrong: corners more than 2 px off.\n"
    )
    print(
        "| | corners in view | ours | wrong | OpenCV | wrong | ours, ms | OpenCV, ms |\n"
        "|---|---|---|---|---|---|---|---|"
    )
    dictionaries = ("DICT_4X4_100", "DICT_5X5_100", "DICT_6X6_250", "DICT_APRILTAG_36h11")
    for name, covered, cut in (("whole", False, False), ("out of view", False, True), ("covered", True, False)):
        rng = np.random.default_rng(7)
        count, milliseconds = np.zeros(5, dtype=int), []
        for _ in range(CHARUCOS):
            squares, marker, kind = rng.integers(3, 14, 2), 0.05 * rng.uniform(0.6, 0.8), rng.random(2) < 0.3
            board = CharucoBoard(
                *map(int, squares), 0.05, marker_m=marker, dictionary=dictionaries[rng.integers(4)],
                inverted=bool(kind[0]), legacy=bool(kind[1]),
            )  # fmt: skip

            def make(b: CharucoBoard = board, cut: bool = cut, **how: object) -> Photograph:
                return Photograph.of(b, drawing=CharucoKind().draw(b), **(how if cut else {**how, "shift": (0.0, 0.0)}))

            view = random_part(rng, covered, make)
            if view is None:
                continue
            begin = time.process_time()
            detection = CharucoDetector().detect(view.image, board)
            middle = time.process_time()
            pixels = 255 - view.image.pixels if board.inverted else view.image.pixels
            corners, ids, _, _ = cv2.aruco.CharucoDetector(opencv_board(board)).detectBoard(pixels)
            milliseconds.append([(middle - begin) * 1e3, (time.process_time() - middle) * 1e3])
            wrong = np.linalg.norm(detection.pixels - view.pixels[detection.ids], axis=1) > NEAR_PX
            found, where = (
                (ids.ravel(), corners.reshape(-1, 2)) if ids is not None else (np.zeros(0, int), np.zeros((0, 2)))
            )
            theirs = np.linalg.norm(where - view.pixels[found], axis=1)
            inside = ((view.pixels > 6) & (view.pixels < np.array(view.image.size) - 7)).all(axis=1)
            count += [inside.sum(), len(detection), wrong.sum(), len(theirs), (theirs > NEAR_PX).sum()]
        ours_ms, opencv_ms = np.median(milliseconds, axis=0)
        print(f"| {name} | " + " | ".join(str(n) for n in count) + f" | {ours_ms:.0f} | {opencv_ms:.0f} |", flush=True)


def main() -> None:
    """Print the tables."""
    cv2.setNumThreads(1)
    checkerboard_parts()
    charuco_parts()


if __name__ == "__main__":
    main()
