"""Faults injected into reading and writing. Each case gives "" when nothing was lost and nothing wrong came out.

Damaged bytes, cut ends, full and failing disks (also a real limit on the size of files), being stopped in the middle,
odd names, many writers of one file. Used by the tests, and with many more cases by ``validation/faults.py``.
"""

import errno
import os
import threading
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any
from unittest import mock

import numpy as np

from opencsp_calib import Calibration, Camera, Checkerboard, Detection, Observations, Pose, SolveOptions, View
from opencsp_calib.board_file import read_board_file, write_board_file
from opencsp_calib.drawing import write_board
from opencsp_calib.errors import CalibError
from opencsp_calib.hdf5 import save_camera
from opencsp_calib.hdf5_calibration import load_calibration, load_observations, save_calibration, save_observations
from opencsp_calib.images import ImageFile, read_image, write_image
from opencsp_calib.importing import exact
from opencsp_calib.journal import Journal
from opencsp_calib.looking import Look
from opencsp_calib.registry import installed

__all__ = [
    "FAULTS",
    "NAMES",
    "SEALED",
    "STEPS",
    "Kind",
    "damaged",
    "failing",
    "kinds",
    "many_writers",
    "odd_name",
    "on_a_small_disk",
]

BOARD = Checkerboard(5, 4, 0.05)
RNG = np.random.default_rng(5)
PIXELS = RNG.uniform(0, 900, (3, 20, 2))
ERRORS = (errno.ENOSPC, errno.EDQUOT, errno.EIO, errno.EROFS, errno.EACCES, errno.EFBIG)
STEPS = ("os.fsync", "os.replace", "os.chmod", "os.open")
FAULTS = (*(OSError(code, os.strerror(code)) for code in ERRORS), KeyboardInterrupt(), MemoryError())
SEALED = ("camera", "observations", "calibration", "journal")
NAMES = (
    "a b", "ü ñ 漢字 📷", "new\nline", "tab\tbell\a", "'quotes\" $HOME `x` ;", "-dash", "per%cent {x}", "[glob]*?", "~",
    "dots..", "x" * 200, "nb\u00a0sp", "\u202ertl", "e\u0301", "C:\\back\\slash", "#hash&amp;<b>", "\udcff\udcfe",
)  # fmt: skip


@dataclass(frozen=True)
class Kind:
    """A kind of file: its name, how one of two contents is written, and what is read from it, to be compared."""

    name: str
    file: str
    write: Callable[[Path, int], None]
    read: Callable[[Path], Any]


def camera(which: int, name: str = "cam") -> Camera:
    return Camera(name, "opencv4", np.array([900.0 + which, 901, 500, 400, -0.2, 0.05, 0.001, -0.002]), (1000, 800))


def observations(which: int) -> Observations:
    found = [Detection(np.arange(20), pixels + which) for pixels in PIXELS]
    views = tuple(View(f"{i}.png", d, "used", sha256=f"{i:064x}") for i, d in enumerate(found))
    return Observations(BOARD, (1000, 800), views)


def calibration(which: int) -> Calibration:
    poses = tuple(Pose(np.array([0.1 * i, 0.2, 0.3]), np.array([0, 0, 2.0])) for i in range(len(PIXELS)))
    outliers = tuple(np.zeros(20, dtype=bool) for _ in PIXELS)
    return Calibration(
        camera(which),
        observations(which),
        poses,
        BOARD,
        "test 1",
        SolveOptions(),
        outliers=outliers,
        covariance=np.eye(8) * (1 + which),
    )


def kinds() -> list[Kind]:
    """All kinds of files that this program writes and reads again, and those that it only writes."""
    found = [
        Kind("camera", "c.h5", lambda p, w: save_camera(camera(w), p, {"focus": str(w)}), Camera.load),
        Kind("observations", "o.h5", lambda p, w: save_observations(observations(w), p), _seen),
        Kind("calibration", "k.h5", lambda p, w: save_calibration(calibration(w), p), _calibrated),
        Kind("journal", "j", _write_journal, _journalled),
        Kind(
            "board file",
            "b.json",
            lambda p, w: write_board_file(BOARD.with_points(BOARD.points * (1 + 0.01 * w)), p),
            _board,
        ),
        Kind("image", "i.png", lambda p, w: write_image(np.full((40, 50), 10 + w, np.uint8), p), _image),
    ]
    drawings = [Kind(f"drawing {suffix}", f"d.{suffix}", _draw, Path.read_bytes) for suffix in ("svg", "pdf", "png")]
    return [*found, *drawings, *(_of_format(f) for f in installed().camera_formats.values() if f.writes)]


def damaged(kind: Kind, folder: Path, seed: int) -> str:
    """Some bytes changed, or the end cut off: an error, or what was written."""
    rng = np.random.default_rng(seed)
    path, whole = folder / kind.file, folder / f"whole-{kind.file}"
    if not whole.exists():
        kind.write(whole, 0)
    content, expected = bytearray(whole.read_bytes()), kind.read(whole)
    for _ in range(int(rng.choice([1, 1, 2, 5, 50]))):
        content[rng.integers(len(content))] = rng.integers(256)
    if rng.random() < 0.3:
        del content[rng.integers(len(content)) :]
    path.write_bytes(bytes(content))
    try:
        return "" if _fits(kind, kind.read(path), expected) else f"{kind.name}, seed {seed}: a wrong result"
    except CalibError:
        return ""
    except Exception as error:
        return f"{kind.name}, seed {seed}: {error!r}"


def failing(kind: Kind, folder: Path, step: str, fault: BaseException) -> str:
    """A step of writing fails when it is taken first: what was there stays, nothing is left over, the error is ours."""
    calls = 0
    kind.write(folder / kind.file, 0)
    module, _, function = step.partition(".")
    original = getattr(__import__(module), function)

    def fail(*arguments: Any, **options: Any) -> Any:
        nonlocal calls
        calls += 1
        if calls == 1:
            raise fault
        return original(*arguments, **options)

    with mock.patch(step, fail):
        found = _written_over(kind, folder, f"{step} {fault!r}")
    return found if calls else f"{kind.name}: {step} is no step of writing it"


def on_a_small_disk(kind: Kind, folder: Path, limit: int) -> str:
    """No file may be larger than so many bytes: the system itself ends the writing."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    path = folder / kind.file
    kind.write(path, 0)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, before[1]))
    try:
        return _written_over(kind, folder, f"at most {limit} bytes")
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def odd_name(kind: Kind, folder: Path, name: str) -> str:
    """A file of a name that nobody expects is written and read all the same."""
    path = folder / f"{name}{Path(kind.file).suffix}"
    try:
        kind.write(path, 1)
        again = kind.read(path)
    except Exception as error:
        return f"{kind.name}, named {name!r}: {error!r}"
    plain = folder / kind.file
    kind.write(plain, 1)
    left = {p.name for p in folder.iterdir()} - {path.name, plain.name}
    return "" if again == kind.read(plain) and not left else f"{kind.name}, named {name!r}: {left or 'a wrong result'}"


def many_writers(kind: Kind, folder: Path, rounds: int) -> list[str]:
    """Two write one file again and again while a third reads: it always reads a whole one. One entry a reading."""
    path = folder / kind.file
    kind.write(path, 0)
    right = [kind.read(path)]
    kind.write(path, 1)
    right.append(kind.read(path))
    over = threading.Event()

    def write(which: int) -> None:
        while not over.is_set():
            kind.write(path, which)

    writers = [threading.Thread(target=write, args=(which,)) for which in (0, 1)]
    for writer in writers:
        writer.start()
    try:
        found = ["" if kind.read(path) in right else f"{kind.name}: half a file was read" for _ in range(rounds)]
    finally:
        over.set()
        for writer in writers:
            writer.join()
    left = sorted(p.name for p in folder.iterdir() if p != path)
    return [*found, f"{kind.name}: {left} is left" if left else ""]


def _written_over(kind: Kind, folder: Path, what: str) -> str:
    path = folder / kind.file
    before = path.read_bytes()
    failed = False
    try:
        kind.write(path, 1)
    except (CalibError, KeyboardInterrupt, MemoryError):
        failed = True
    except Exception as error:
        return f"{kind.name}, {what}: {error!r}"
    left = sorted(p.name for p in folder.iterdir() if p != path)
    if left:
        return f"{kind.name}, {what}: {left} is left"
    if failed:
        return "" if path.read_bytes() == before else f"{kind.name}, {what}: what was there is lost"
    return "" if path.read_bytes() != before else f"{kind.name}, {what}: said to be written, but is not"


def _fits(kind: Kind, found: Any, expected: Any) -> bool:
    if kind.name == "journal":  # results may be missing: those images are looked at again
        return all(found[key] is None or found[key] == expected[key] for key in expected)
    return bool(found == expected)


def _of_format(format_: Any) -> Kind:
    def read(path: Path) -> Any:
        (imported,) = format_.read(path).values()
        return exact(imported).params.tolist()

    def write(path: Path, which: int) -> None:
        format_.write({"1": camera(which, "1")}, path)

    return Kind(format_.name, f"f{format_.extensions[0]}", write, read)


def _seen(path: Path) -> Any:
    return _as_plain(load_observations(path))


def _as_plain(seen: Observations) -> Any:
    views = [(v.image, v.status, v.sha256, v.detection.ids.tolist(), v.detection.pixels.tolist()) for v in seen.views]
    return seen.board.spec, seen.board.points.tolist(), seen.image_size, views


def _calibrated(path: Path) -> Any:
    found = load_calibration(path)
    poses = [(p.rotation.tolist(), p.translation.tolist()) for p in found.cam_from_board]
    return found.camera, _as_plain(found.observations), poses, found.covariance.tolist(), found.solver


def _write_journal(path: Path, which: int) -> None:
    journal = Journal(path, resume=False)
    path.unlink(missing_ok=True)
    with journal.open("search"):
        for view in observations(which).views:
            journal.add(Look(view, (1000, 800)))


def _journalled(path: Path) -> Any:
    with Journal(path).open("search") as journal:
        found = {i: journal.find(f"{i:064x}", f"{i}.png") for i in range(len(PIXELS))}
    return {i: look and (look.size, look.view.detection.pixels.tolist()) for i, look in found.items()}


def _board(path: Path) -> Any:
    return read_board_file(path, lambda spec: replace(BOARD)).points.tolist()


def _image(path: Path) -> Any:
    return read_image(ImageFile("i", path)).pixels.tolist()


def _draw(path: Path, which: int) -> None:
    board = replace(BOARD, spacing_m=0.02 + 0.01 * which, points=None)
    write_board(board, installed().boards["checkerboard"].draw(board), path)
