"""The long work itself, in a process of its own: ``python -m opencsp_calib.gui.jobs``, started by `work.py`.

Each line of standard input is a job as JSON, each line of standard output an answer. It ends with its standard input,
so that it never outlives the window, however that ended.
"""

import json
import os
import queue
import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from typing import Any, TextIO, TypeAlias

from opencsp_calib.errors import CalibError

Tell: TypeAlias = Callable[[dict[str, Any]], None]


def main() -> None:
    """Do one job after another until standard input ends."""
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())  # a library that prints must not garble the answers
    asked: queue.Queue[dict[str, Any]] = queue.Queue()
    threading.Thread(target=_listen, args=(asked,), daemon=True).start()
    _load()
    while True:
        request = asked.get()
        try:
            done = JOBS[request.pop("job")](lambda answer: _tell(answers, answer), **request)
            _tell(answers, {"done": done})
        except CalibError as error:
            _tell(answers, {"error": str(error), "exit_code": error.exit_code})
        except Exception as error:  # a defect: told, and the window lives on
            traceback.print_exc()
            _tell(answers, {"error": f"unexpected: {error!r}", "exit_code": 1})


def _listen(asked: "queue.Queue[dict[str, Any]]") -> None:
    for line in sys.stdin:
        asked.put(json.loads(line))
    os._exit(0)


def _load() -> None:
    """Load beforehand what a job will need."""
    from opencsp_calib import pipeline  # noqa: F401
    from opencsp_calib.corners import prepare
    from opencsp_calib.registry import installed

    prepare()
    for solver in installed().solvers.values():
        solver.missing()


def _tell(answers: TextIO, answer: dict[str, Any]) -> None:
    answers.write(json.dumps(answer) + "\n")
    answers.flush()


def find_corners(
    tell: Tell, images: list[str], board: str, options: Mapping[str, Any], observations: str, journal: str
) -> None:
    """Look for the board in photographs; tells each view as it is done, and writes a file of observations.

    What the journal knows is not looked for again: a search that was cancelled goes on, and one of a few photographs
    more looks at those only.
    """
    from opencsp_calib import pipeline
    from opencsp_calib.detection import View
    from opencsp_calib.hdf5_calibration import save_observations
    from opencsp_calib.journal import Journal
    from opencsp_calib.summary import view_as_json

    def progress(done: int, total: int, view: View) -> None:
        tell({"done_images": done, "total": total, "view": view_as_json(view)})

    found = pipeline.detect(images, pipeline.board_from(board), progress=progress, journal=Journal(journal), **options)
    save_observations(found, observations)


def solve(
    tell: Tell,
    observations: str,
    exclude: list[str],
    options: dict[str, Any],
    guess: str | None,
    calibration: str,
) -> None:
    """Solve for the camera, without the images to be excluded; writes a camera file."""
    from opencsp_calib import dropping, pipeline
    from opencsp_calib.hdf5_calibration import load_observations, save_calibration

    observed = dropping.excluding(load_observations(observations), exclude)
    save_calibration(pipeline.solve(observed, **options), calibration)


JOBS: dict[str, Callable[..., Any]] = {"find_corners": find_corners, "solve": solve}

if __name__ == "__main__":
    main()
