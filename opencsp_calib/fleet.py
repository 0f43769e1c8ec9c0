"""Many cameras in one run: each calibrated by itself, and held against what it was last time.

Whatever goes wrong with one camera is its result; the others go on.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, TypeAlias

from opencsp_calib import dropping, judgement, pipeline
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration
from opencsp_calib.check import Judged, judged, worse
from opencsp_calib.cluster import Scheduler
from opencsp_calib.detecting import Progress, Stop
from opencsp_calib.errors import CalibError, CancelledError, InputError
from opencsp_calib.fleet_file import FleetCamera
from opencsp_calib.hdf5 import load_camera
from opencsp_calib.hdf5_calibration import load_calibration, save_calibration
from opencsp_calib.images import find_images
from opencsp_calib.journal import Journal
from opencsp_calib.summary import PIXEL_PITCH

__all__ = ["CAMERA_FILE", "REPORT_FILE", "Change", "FleetResult", "board_below", "calibrate_camera"]

CAMERA_FILE, REPORT_FILE = "camera.h5", "report.html"
OF_DETECTION = ("detector", "refine")
OF_SOLVING = ("model", "solver", "board-shape", "pixel-aspect", "weights", "robust")
CHANGE: dict[str, Literal["unchanged", "doubtful", "changed"]] = {
    "ok": "unchanged",
    "degraded": "doubtful",
    "wrong": "changed",
}

WriteReport: TypeAlias = Callable[[Calibration, Path], None]


@dataclass(frozen=True)
class Change:
    """How a camera differs from what it was last time, by projection, frames aligned.

    Parameters
    ----------
    level : 'unchanged', 'doubtful' or 'changed'
        Within two sigmas; between; beyond five, or by more than a pixel.
    sentence : str
    rms_px, worst_px : float, optional
        Over the image; None where the two cannot be compared.
    predicted_px : float, optional
        One sigma of the rms: what uncertainty alone explains.
    """

    level: Literal["unchanged", "doubtful", "changed"]
    sentence: str
    rms_px: float | None = None
    worst_px: float | None = None
    predicted_px: float | None = None


@dataclass(frozen=True, eq=False)
class FleetResult:
    """What became of one camera.

    Parameters
    ----------
    name : str
    folder : Path
        Where its camera file and report are.
    verdict : 'good', 'doubt', 'bad' or 'failed'
    sentence : str
        What the verdict is, or why it failed.
    calibration : Calibration, optional
        None where it failed.
    change : Change, optional
        None where there was no camera before.
    """

    name: str
    folder: Path
    verdict: Literal["good", "doubt", "bad", "failed"]
    sentence: str
    calibration: Calibration | None = field(default=None, repr=False)
    change: Change | None = None

    def as_json(self) -> dict[str, Any]:
        """One of the ``cameras`` of ``fleet --json``."""
        found = self.calibration
        return {
            "name": self.name,
            "verdict": self.verdict,
            "sentence": self.sentence,
            "rms_px": found and found.rms_px,
            "views_used": found and len(found.observations.used),
            "images": found and len(found.observations.views),
            "warnings": found and [problem.code for problem in judgement.judge(found)],
            "change": self.change and vars(self.change),
            "camera": str(self.folder / CAMERA_FILE) if found else None,
            "report": str(self.folder / REPORT_FILE) if found else None,
        }


def calibrate_camera(
    camera: FleetCamera,
    folder: Path,
    write_report: WriteReport,
    *,
    jobs: int | None = None,
    progress: Progress | None = None,
    stop: Stop | None = None,
    journal: Journal | None = None,
    scheduler: "Scheduler | None" = None,
) -> FleetResult:
    """Calibrate one camera of a fleet; write its camera file and report.

    Parameters
    ----------
    camera : FleetCamera
    folder : Path
        For its results; made where there is none. What stands there from last time stays where this time fails.
    write_report : callable
        Takes the calibration and the path to write to.
    jobs, progress, stop, journal, scheduler : optional
        See `opencsp_calib.pipeline.detect`.

    Raises
    ------
    CancelledError
        If it was stopped; everything else that goes wrong is in the result.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        found = _solved(camera, jobs=jobs, progress=progress, stop=stop, journal=journal, scheduler=scheduler)
        change = _change(found, folder / CAMERA_FILE)
        save_calibration(found, folder / CAMERA_FILE)
        write_report(found, folder / REPORT_FILE)
    except CancelledError:
        raise
    except CalibError as error:
        return FleetResult(camera.name, folder, "failed", str(error))
    except OSError as error:
        return FleetResult(camera.name, folder, "failed", f"{error.filename or folder}: {error.strerror or error}")
    except Exception as error:  # a plugin's defect, or ours: the other cameras are not to suffer from it
        return FleetResult(camera.name, folder, "failed", f"a defect of the program: {error!r}")
    judged_so = judgement.verdict(found)
    return FleetResult(camera.name, folder, judged_so.level, judged_so.sentence, found, change)


def _solved(camera: FleetCamera, **how: Any) -> Calibration:
    settings = camera.settings
    if "board" not in settings:
        raise InputError("which board was photographed is not said; add board: SPEC, or --board SPEC")
    images = [str(camera.root / pattern) for pattern in camera.images]
    board = board_below(camera.root, settings["board"])
    finding = {key: settings[key] for key in OF_DETECTION if key in settings}
    options = {key.replace("-", "_"): settings[key] for key in OF_SOLVING if key in settings}
    pipeline.check_solving(**options)
    exclude = settings.get("exclude", ())
    dropping.check_dropping([file.name for file in find_images(images)], exclude)
    observations = dropping.excluding(pipeline.detect(images, board, **finding, **how), exclude)
    options |= {"name": camera.name, "record": _record(settings), "provenance": pipeline.places_of(images)}
    if "select" in settings:
        observations = pipeline.select(observations, settings["select"], **options).observations
    return pipeline.solve(observations, **options)


def board_below(root: Path, board: str) -> Board:
    """As `pipeline.board_from`, but that a board file's name starts from the fleet's folder."""
    return pipeline.board_from(str(root / board) if (root / board).is_file() else board)


def _record(settings: Any) -> dict[str, str]:
    record = {str(key): str(value) for key, value in settings.get("note", {}).items()}
    return record | ({PIXEL_PITCH: f"{settings['pixel-pitch']:g}"} if "pixel-pitch" in settings else {})


def _change(found: Calibration, before: Path) -> Change | None:
    """Against the camera file of last time, if there is one."""
    if not before.exists():
        return None
    try:
        camera = load_camera(before)
    except CalibError as error:
        return Change("doubtful", f"last time's camera cannot be read: {error}")
    if camera.image_size != found.camera.image_size:
        size = "x".join(map(str, camera.image_size))
        return Change("changed", f"last time's images were {size}")
    try:
        last: Calibration | None = load_calibration(before)
    except CalibError:  # a camera from elsewhere, without how it was calibrated
        last = None
    worst = worse(*judged(camera, found, None if last is None else last.covariance))
    level = CHANGE[worst.verdict]
    return Change(
        level,
        _sentence(worst, last is not None and _photographs(last) == _photographs(found)),
        worst.difference.rms_px,
        worst.difference.worst_px,
        worst.predicted_px,
    )


def _photographs(calibration: Calibration) -> set[str]:
    return {view.sha256 for view in calibration.observations.used}


def _sentence(worst: Judged, same: bool) -> str:
    apart = worst.difference
    figures = f"{apart.rms_px:.2g} px rms, {apart.worst_px:.2g} px at worst {apart.where}"
    text = f"{figures}, where {worst.predicted_px:.2g} px are"
    return f"{text} within one sigma" + ("; solved from the same photographs" if same else "")
