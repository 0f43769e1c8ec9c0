"""Finding boards, beside OpenCV's and calib-targets' searches, on real and rendered photographs; and finding none.

Claim
    Every view of both real checkerboard sets is found, and of the ChArUco set the 11 frames that show the board and
    none of the 3 that do not. No image costs more than 1 s, whatever it shows. Ours finds whatever the others find.

Way
    Rendered photographs are 1626 x 1236, of a board of 18 x 23 corners (unless said otherwise) in a cluttered room, at
    random poses; the renderer shares no code with any search. A view counts as found if all corners are there, each
    within 2 px of the truth, from where the fit of the corners finds home. Times are of the processor, with one thread
    (calib-targets uses its own, which are counted). "OpenCV's classic" is `findChessboardCorners` as OpenCSP calls it,
    without `cornerSubPix`.

Run ``python validation/bench.py detection``. It needs calib-targets: ``pip install --group studies``.
"""

import sys
import time
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path

import cv2
import numpy as np
from _real_data import DATA
from calib_targets import detect_chessboard
from opencsp_calib_opencv.board_kinds import CharucoKind
from opencsp_calib_opencv.charuco import CharucoDetector
from opencsp_calib_opencv.checkerboard import CheckerboardDetector
from threadpoolctl import threadpool_limits

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from board_photographs import Photograph, small_camera

from opencsp_calib import CharucoBoard, Checkerboard, Image
from opencsp_calib.images import find_images, read_image
from opencsp_calib.rendering import Exposure, Scene

SIZE = (1626, 1236)
BOARD = Checkerboard(18, 23, 0.05)
VIEWS = 12
NEAR_PX = 2.0
CAMERA = small_camera(2700.0, -0.17, 0.2, SIZE)
WIDE = small_camera(800.0, -0.24, 0.04, SIZE)

Corners = np.ndarray
Search = Callable[[Image, Checkerboard], Corners]


def ours(image: Image, board: Checkerboard) -> Corners:
    """Found by this project."""
    return CheckerboardDetector().detect(image, board).pixels


def classic(image: Image, board: Checkerboard) -> Corners:
    """Found by OpenCV as OpenCSP calls it."""
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH + cv2.CALIB_CB_FAST_CHECK + cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners = cv2.findChessboardCorners(image.pixels, board.grid, flags=flags)
    return corners.reshape(-1, 2) if found else np.empty((0, 2))


def sector(image: Image, board: Checkerboard) -> Corners:
    """Found by OpenCV's newer search, as it is."""
    found, corners = cv2.findChessboardCornersSB(image.pixels, board.grid)
    return corners.reshape(-1, 2) if found else np.empty((0, 2))


def sector_exhaustive(image: Image, board: Checkerboard) -> Corners:
    """Found by the newer search with all it has."""
    flags = cv2.CALIB_CB_EXHAUSTIVE + cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners = cv2.findChessboardCornersSB(image.pixels, board.grid, flags=flags)
    return corners.reshape(-1, 2) if found else np.empty((0, 2))


def targets(image: Image, board: Checkerboard) -> Corners:
    """Found by calib-targets, which is not told the board's size."""
    found = detect_chessboard(image.pixels)
    return np.array([corner.position for corner in found.corners]) if found else np.empty((0, 2))


SEARCHES: dict[str, Search] = {
    "ours": ours,
    "OpenCV's classic": classic,
    "SB": sector,
    "SB, exhaustive": sector_exhaustive,
    "calib-targets": targets,
}

CONDITIONS: dict[str, dict] = {
    "as it should be": {},
    "squares of 20 px": {"fill": 0.42},
    "squares of 12 px": {"fill": 0.25},
    "squares of 8 px": {"fill": 0.17},
    "tilt 60 degrees": {"tilt_deg": 60.0},
    "tilt 70 degrees": {"tilt_deg": 70.0},
    "blur 2 px": {"exposure": Exposure(psf_px=2.0)},
    "blur 4 px": {"exposure": Exposure(psf_px=4.0)},
    "defocus 12 px": {"exposure": Exposure(defocus_px=12.0)},
    "moved by 10 px": {"exposure": Exposure(motion_px=(7.0, 7.0))},
    "noise 10": {"exposure": Exposure(noise=10.0)},
    "noise 20": {"exposure": Exposure(noise=20.0)},
    "underexposed eightfold": {"exposure": Exposure(gain=0.12)},
    "clipped": {"exposure": Exposure(gain=2.0)},
    "contrast 15 of 255": {"scene": Scene(white=80.0, black=65.0, clutter=60.0)},
    "light from one side": {"scene": Scene(shading=(1.3, -1.0))},
    "margin of 0.15 squares": {"scene": Scene(margin_squares=0.15)},
    "no margin, dark room": {"scene": Scene(margin_squares=0.0, background=15.0, clutter=10.0)},
    "wide lens": {"camera": WIDE},
    "9 x 6": {"board": Checkerboard(9, 6, 0.05)},
    "9 x 6, squares of 12 px": {"board": Checkerboard(9, 6, 0.05), "fill": 0.1},
    "3 x 3": {"board": Checkerboard(3, 3, 0.05)},
}


def photographs(condition: dict, views: int) -> Iterator[Photograph]:
    """Rendered at random poses under one condition."""
    rng = np.random.default_rng(1)
    for view in range(views):
        how = {
            "tilt_deg": rng.uniform(0, 45), "azimuth_deg": rng.uniform(0, 360), "roll_deg": rng.uniform(-180, 180),
            "fill": rng.uniform(0.7, 0.95), "position": tuple(rng.uniform(0, 1, 2)), "camera": CAMERA, "rng": view,
        }  # fmt: skip
        how.update(condition)
        yield Photograph.of(how.pop("board", BOARD), **how)


def is_found(corners: Corners, photograph: Photograph) -> bool:
    """Whether they are the board's, in whatever order."""
    if len(corners) != len(photograph.pixels):
        return False
    nearest = np.linalg.norm(corners[:, None] - photograph.pixels, axis=2)
    return len(set(nearest.argmin(axis=1))) == len(corners) and nearest.min(axis=1).max() < NEAR_PX


def timed(search: Search, image: Image, board: Checkerboard) -> tuple[Corners, float]:
    """What a search finds, and the milliseconds of processor time it takes."""
    begin = time.process_time()
    return search(image, board), (time.process_time() - begin) * 1e3


def real_sets() -> None:
    """The real photographs."""
    print("\n### Real photographs\n\nViews found, median and longest ms an image.\n")
    print("| set | " + " | ".join(SEARCHES) + " |\n|---|" + "---|" * len(SEARCHES))
    for folder, board in (("sandia_checkerboard", BOARD), ("opencv_left", Checkerboard(9, 6, 0.025))):
        images = [read_image(file) for file in find_images(DATA / folder)]
        cells = []
        for search in SEARCHES.values():
            results = [timed(search, image, board) for image in images]
            found = sum(len(corners) == len(board.points) for corners, _ in results)
            milliseconds = [ms for _, ms in results]
            cells.append(f"{found} of {len(images)}, {np.median(milliseconds):.0f}, {max(milliseconds):.0f}")
        print(f"| {folder} | " + " | ".join(cells) + " |")
    board = CharucoKind().parse("charuco:4x5:54mm:40.5mm:DICT_4X4_50:inverted")
    counts, milliseconds = {}, []
    for file in find_images(DATA / "charuco_inverted"):
        begin = time.process_time()
        counts[file.name] = len(CharucoDetector().detect(read_image(file), board))
        milliseconds.append((time.process_time() - begin) * 1e3)
    shown = [count for name, count in counts.items() if name >= "frame_0068"]
    hidden = [count for name, count in counts.items() if name < "frame_0068"]
    print(
        f"\n`charuco_inverted`, ours: {sum(c > 0 for c in shown)} of {len(shown)} frames that show the board "
        f"({min(shown)} to {max(shown)} of 12 corners), {sum(c > 0 for c in hidden)} of {len(hidden)} that do not; "
        f"{np.median(milliseconds):.0f} ms, {max(milliseconds):.0f} at most, reading included."
    )


def rendered() -> None:
    """All searches under all conditions."""
    print(f"\n### Rendered photographs\n\nViews found of {VIEWS}, median ms, and the longest.\n")
    print("| condition | " + " | ".join(SEARCHES) + " |\n|---|" + "---|" * len(SEARCHES))
    totals = dict.fromkeys(SEARCHES, 0)
    for name, condition in CONDITIONS.items():
        views, cells = list(photographs(condition, VIEWS)), []
        for search_name, search in SEARCHES.items():
            results = [timed(search, view.image, view.board) for view in views]
            found = sum(is_found(corners, view) for (corners, _), view in zip(results, views, strict=True))
            totals[search_name] += found
            milliseconds = [ms for _, ms in results]
            cells.append(f"{found}, {np.median(milliseconds):.0f}, {max(milliseconds):.0f}")
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    print("| all | " + " | ".join(f"{n} of {VIEWS * len(CONDITIONS)}" for n in totals.values()) + " |")


def nothing_there() -> None:
    """What it costs to find nothing."""
    print("\n### Images without the board\n\nms, 1626 x 1236 unless said otherwise; and what is said.\n")
    print("| image | checkerboard:18x23 | charuco:8x6 | said of the first |\n|---|---|---|---|")
    rng = np.random.default_rng(0)
    y, x = np.mgrid[: SIZE[1], : SIZE[0]]
    text = np.full(SIZE[::-1], 240, dtype=np.uint8)
    for line in range(20, SIZE[1], 20):
        letters = "".join(chr(c) for c in rng.integers(33, 126, 95))
        cv2.putText(text, letters, (5, line), cv2.FONT_HERSHEY_SIMPLEX, 0.6, 20, 1)
    images = {
        "blank": np.full(x.shape, 128),
        "noise": rng.integers(0, 256, x.shape),
        "text": text,
        "moire": 128 + 60 * np.sin(2.9 * x) * np.sin(2.95 * y) + 50 * np.sin(0.3 * x + 0.02 * y),
        "tiles of 8 px": 255 * ((x // 8 + y // 8) % 2),
        "tiles of 20 px": 255 * ((x // 20 + y // 20) % 2),
        "tiles of 60 px": 255 * ((x // 60 + y // 60) % 2),
        "waves": 128 + 100 * np.sin(0.2 * x) * np.sin(0.2 * y),
        "a room": next(photographs({"board": Checkerboard(9, 6, 0.05), "fill": 0.02}, 1)).image.pixels,
        "another board": next(photographs({"board": Checkerboard(17, 23, 0.05)}, 1)).image.pixels,
        "108 megapixels of noise": rng.integers(0, 256, (9000, 12000)),
    }
    charuco = CharucoBoard(8, 6, 0.04, marker_m=0.03, dictionary="DICT_5X5_100")
    for name, pixels in images.items():
        image = Image(name, pixels.astype(np.uint8))
        begin = time.process_time()
        detection = CheckerboardDetector().detect(image, BOARD)
        middle = time.process_time()
        CharucoDetector().detect(image, charuco)
        end = time.process_time()
        print(f"| {name} | {(middle - begin) * 1e3:.0f} | {(end - middle) * 1e3:.0f} | {detection.reason} |")


def main() -> None:
    """Print the tables."""
    cv2.setNumThreads(1)
    threadpool_limits(1, user_api="blas")  # whose threads count while they wait
    for search in SEARCHES.values():  # nothing is timed that is done once
        search(next(photographs({}, 1)).image, BOARD)
    print(f"OpenCV {cv2.__version__}, calib-targets {version('calib-targets')}.")
    real_sets()
    rendered()
    nothing_there()


if __name__ == "__main__":
    main()
