"""Corners in real photographs: how well they fit one camera.

Claim
    With a flat board, model opencv4 and OpenCV's solver: ``opencv_left`` at most 0.162 px rms in all 13 views,
    Sandia's ten at most 0.186. With the board's shape free, Sandia's at most 0.0155. Of ``charuco_inverted`` the eleven
    frames that show the board are used and none of the three that do not.

Way
    Default detection; rms of residual vectors, as OpenCV reports it. cornerSubPix starts at the corners that we find.
    The ChArUco frames are small, sharpened, compressed, and the board is held in the hand.

Run ``python validation/bench.py corners_real``, with the real photographs where the tests find them.
"""

from dataclasses import replace
from pathlib import Path

from _corner_subpix import by_subpix
from _real_data import DATA

from opencsp_calib import Board, Checkerboard, Observations, SolveOptions, detect
from opencsp_calib.corners import refine
from opencsp_calib.images import find_images, read_image
from opencsp_calib.registry import installed

SETS: dict[str, tuple[Board, float]] = {
    "opencv_left": (Checkerboard(9, 6, 0.025), 0.162),
    "sandia_checkerboard": (Checkerboard(18, 23, 0.05), 0.186),
}
CHARUCO = "charuco:4x5:54mm:40.5mm:DICT_4X4_50:inverted"


def rms_px(observations: Observations, solver: str = "opencv", shape: str = "flat") -> float:
    """Of a calibration with four coefficients."""
    options = SolveOptions(board_shape=shape)
    return float(installed().solvers[solver].solve(observations, "opencv4", options).rms_px)


def refined_by_subpix(observations: Observations, folder: Path, half_window: int) -> Observations:
    """The same corners, refined by OpenCV's way."""
    views = []
    for view, file in zip(observations.views, find_images(folder), strict=True):
        found = by_subpix(read_image(file).pixels, view.detection.pixels, half_window)
        views.append(replace(view, detection=replace(view.detection, pixels=found, covariance=None)))
    return replace(observations, views=tuple(views))


def checkerboards() -> None:
    """Print a table."""
    print("| set | views | corners | rms px, flat board | asked | cornerSubPix 5 | cornerSubPix 11 |")
    print("|---|---|---|---|---|---|---|")
    for name, (board, asked) in SETS.items():
        observations = detect(DATA / name, board)
        corners = f"{sum(map(len, observations.detections))} of {len(observations.views) * len(board.points)}"
        views = f"{len(observations.used)} of {len(observations.views)}"
        ours, *theirs = map(
            rms_px, (observations, *(refined_by_subpix(observations, DATA / name, half) for half in (5, 11)))
        )
        print(f"| {name} | {views} | {corners} | {ours:.4f} | {asked} | {theirs[0]:.4f} | {theirs[1]:.4f} |")
    print(f"\nSandia with the board's shape free: {rms_px(observations, 'bundle', 'free'):.4f} px.")


def charuco() -> None:
    """Print what became of each frame."""
    board = installed().board(CHARUCO)
    detector = installed().detector_for(board)
    print("\n| frame | corners found | kept by the fit | said |\n|---|---|---|---|")
    for file in find_images(DATA / "charuco_inverted"):
        image = read_image(file)
        found = detector.detect(image, board)
        kept = refine(image, found, board)
        print(f"| {file.name} | {len(found)} | {len(kept)} | {kept.reason} |")
    observations = detect(DATA / "charuco_inverted", board)
    print(f"\n{len(observations.used)} of {len(observations.views)} frames used, rms {rms_px(observations):.4f} px.")


def main() -> None:
    """Print the tables."""
    checkerboards()
    charuco()


if __name__ == "__main__":
    main()
