"""The long work itself, in a process of its own, started by `work.py`.

Each line of standard input is a job as JSON, each line of standard output an answer. It ends with its standard input,
so that it never outlives the window, however that ended.
"""

import gc
import json
import os
import queue
import sys
import threading
import traceback
from collections.abc import Callable
from dataclasses import asdict
from typing import IO, Any, TypeAlias

from opencsp_calib.errors import CalibError
from opencsp_calib.processes import answers

Tell: TypeAlias = Callable[[dict[str, Any]], None]


def main() -> None:
    """Do one job after another until standard input ends."""
    told = answers("w")
    asked: queue.Queue[dict[str, Any]] = queue.Queue()
    threading.Thread(target=_listen, args=(asked,), daemon=True).start()
    _load()
    while True:
        request = asked.get()
        try:
            done = JOBS[request.pop("job")](lambda answer: _tell(told, answer), **request)
            _tell(told, {"done": done})
        except CalibError as error:
            _tell(told, {"error": str(error), "exit_code": error.exit_code})
        except Exception as error:  # a defect: told, and the window lives on
            traceback.print_exc()
            _tell(told, {"error": f"unexpected: {error!r}", "exit_code": 1})


def _listen(asked: "queue.Queue[dict[str, Any]]") -> None:
    for line in sys.stdin:
        asked.put(json.loads(line))
    os._exit(0)


def _load() -> None:
    """Load beforehand what a job will need."""
    from opencsp_calib import pipeline  # noqa: F401
    from opencsp_calib.registry import installed

    for solver in installed().solvers.values():
        solver.missing()
    gc.freeze()  # looking for cycles among what stays takes a 20th of the work's time


def _tell(told: IO[str], answer: dict[str, Any]) -> None:
    told.write(json.dumps(answer) + "\n")
    told.flush()


def find_corners(
    tell: Tell,
    images: list[str],
    board: str,
    options: dict[str, Any],
    observations: str,
    journal: str,
    thumbnails: str,
) -> None:
    """Look for the board in photographs; tells each view as it is done, and writes a file of observations.

    What the journal knows is not looked for again: a search that was cancelled goes on, and one of a few photographs
    more looks at those only.
    """
    from pathlib import Path

    from opencsp_calib import pipeline
    from opencsp_calib.detection import View
    from opencsp_calib.gui.thumbnails import KeepingThumbnails, Thumbnails
    from opencsp_calib.hdf5_calibration import save_observations
    from opencsp_calib.images import find_images
    from opencsp_calib.journal import Journal
    from opencsp_calib.registry import installed
    from opencsp_calib.summary import view_as_json

    def progress(done: int, total: int, view: View) -> None:
        tell({"done_images": done, "total": total, "view": view_as_json(view)})

    target, known = pipeline.board_from(board), installed()
    chosen = options.pop("detector", None)
    detector = known.detector(chosen) if chosen else known.detector_for(target)
    paths = {file.name: file.path for file in find_images(images)}
    keeping = KeepingThumbnails(detector, Thumbnails(Path(thumbnails)), paths)
    found = pipeline.detect(images, target, detector=keeping, progress=progress, journal=Journal(journal), **options)
    save_observations(found, observations)


def solve(
    tell: Tell,
    observations: str,
    exclude: list[str],
    options: dict[str, Any],
    guess: str,
    calibration: str,
    select: int = 0,
    drop_worst: int = 0,
    max_rms: float | None = None,
) -> dict[str, str]:
    """Solve for the camera, without the images to be excluded or left out; writes a camera file, gives the verdict."""
    from opencsp_calib import dropping, pipeline
    from opencsp_calib.camera_files import read_camera_file
    from opencsp_calib.hdf5_calibration import load_observations, save_calibration
    from opencsp_calib.judgement import verdict

    if guess:
        options["guess"] = read_camera_file(guess).camera
    observed = dropping.excluding(load_observations(observations), exclude)
    if select:
        observed = pipeline.select(observed, select, **options).observations
    result = pipeline.solve(observed, **options)
    if drop_worst:
        result = dropping.drop_worst(result, drop_worst, lambda views: pipeline.solve(views, **options))
    if max_rms is not None:
        result = dropping.drop_above(result, max_rms, lambda views: pipeline.solve(views, **options))
    save_calibration(result, calibration)
    return asdict(verdict(result))


def validate(tell: Tell, calibration: str, sections: str) -> str:
    """Put a calibration to every test there is; writes what came of it as HTML, gives the verdict."""
    from opencsp_calib.atomic import replacing
    from opencsp_calib.hdf5_calibration import load_calibration
    from opencsp_calib.registry import installed
    from opencsp_calib.report import validation_sections
    from opencsp_calib.validate import validate as validated

    found = validated(load_calibration(calibration), installed().solvers)
    with replacing(sections) as temporary:
        temporary.write_text("".join(validation_sections(found)), encoding="utf-8")
    return found.verdict


def report(tell: Tell, calibration: str, before: str, target: str) -> None:
    """Write the report of a calibration."""
    from opencsp_calib.hdf5_calibration import load_calibration
    from opencsp_calib.report import write_report

    write_report(load_calibration(calibration), target, before=load_calibration(before) if before else None)


def check(tell: Tell, camera: dict[str, Any], images: list[str], board: str) -> dict[str, Any]:
    """Hold a camera file against photographs; the board is by default that which it was calibrated with."""
    from opencsp_calib import pipeline
    from opencsp_calib.camera_files import read_camera_file
    from opencsp_calib.check import check as checked
    from opencsp_calib.detection import View
    from opencsp_calib.errors import InputError

    def progress(done: int, total: int, _: View) -> None:
        tell({"done_images": done, "total": total})

    opened = read_camera_file(**camera)
    known, calibration = opened.camera, opened.calibration
    if not (board or calibration):
        raise InputError("describe the board under Calibrate first: this camera file does not tell which it was")
    target = pipeline.board_from(board) if board or calibration is None else calibration.observations.board
    seen = pipeline.detect(images, target, progress=progress)
    found = checked(known, seen, lambda views: pipeline.solve(views, known.model), calibration)
    notes = [problem.message for problem in found.problems]
    return found.as_json() | {"name": known.name, "reasons": [*found.reasons, *notes]}


def undistort(tell: Tell, camera: dict[str, Any], images: list[str], folder: str) -> None:
    """Write photographs without their lens distortion into another folder."""
    from pathlib import Path

    from opencsp_calib.camera_files import read_camera_file
    from opencsp_calib.images import find_images
    from opencsp_calib.undistortion import undistort_images

    def progress(done: int, total: int) -> None:
        tell({"done_images": done, "total": total})

    undistort_images(read_camera_file(**camera).camera, find_images(images), Path(folder), progress)


def fleet(tell: Tell, where: str, given: dict[str, str]) -> dict[str, Any]:
    """Calibrate many cameras, by a folder of folders or a file; the settings given hold where there is no file.

    A run that was stopped goes on where it was.
    """
    from pathlib import Path

    from opencsp_calib.detection import View
    from opencsp_calib.fleet import CAMERA_FILE, FleetResult, calibrate_camera
    from opencsp_calib.fleet_file import FILE_NAME, find_fleet
    from opencsp_calib.journal import Journal, journal_beside
    from opencsp_calib.report import write_fleet, write_report

    path = Path(where)
    cameras = find_fleet(path, {} if path.is_file() or (path / FILE_NAME).is_file() else given)
    root = cameras[0].root
    journals = [Journal(journal_beside(root / camera.name / CAMERA_FILE)) for camera in cameras]

    def calibrated(number: int) -> FleetResult:
        camera = cameras[number]
        what = f"Calibrating {camera.name} ({number + 1} of {len(cameras)})"

        def progress(done: int, total: int, _: View) -> None:
            tell({"what": what, "done_images": done, "total": total})

        return calibrate_camera(camera, root / camera.name, write_report, progress=progress, journal=journals[number])

    results = [calibrated(number) for number in range(len(cameras))]
    write_fleet(results, root.absolute().name, root / "fleet.html")
    for journal in journals:
        journal.remove()
    return {"cameras": [result.as_json() for result in results], "report": str(root / "fleet.html")}


JOBS: dict[str, Callable[..., Any]] = {
    job.__name__: job for job in (find_corners, solve, validate, report, check, undistort, fleet)
}
