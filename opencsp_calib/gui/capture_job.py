"""A capture in a process of its own, started by `live_capture.py`.

The first line of standard input says, as JSON, what to capture; each further one is ``press``, ``delete`` or ``stop``.
Each line of standard output is JSON: a frame with all there is to show of it, something said, what came of it at last,
or what went wrong. It stops with its standard input, so that it never outlives the window; every photograph is whole on
the disk whenever it is ended.
"""

import base64
import json
import os
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np

from opencsp_calib.arrays import Pixels
from opencsp_calib.capture import Prepared, State, prepared, settings_from
from opencsp_calib.coach.wording import described
from opencsp_calib.errors import CalibError
from opencsp_calib.images import encode_thumbnail
from opencsp_calib.processes import answers

__all__ = ["frame_as_json", "main"]


def main() -> None:
    """Run one capture."""
    told = answers("w")

    def tell(answer: dict[str, Any]) -> None:
        told.write(json.dumps(answer) + "\n")
        told.flush()

    asked = json.loads(sys.stdin.readline())
    shown_px = asked.pop("shown_px")
    try:
        asked["settings"] = settings_from(asked["settings"])
        ready = prepared(Path(asked.pop("folder")), asked.pop("board"), **asked, tell=lambda text: tell({"say": text}))
        threading.Thread(target=_listen, args=(ready,), daemon=True).start()
        ready.run(lambda state: tell({"frame": frame_as_json(state, shown_px)}), lambda text: tell({"say": text}))
        tell({"done": len(ready.capture.folder.images)})
    except CalibError as error:
        tell({"error": str(error)})


def _listen(ready: Prepared) -> None:
    capture = ready.capture
    actions = {"press": capture.press, "delete": capture.delete_last, "stop": capture.stop}
    for line in sys.stdin:
        actions[line.strip()]()
    os._exit(0)


def frame_as_json(state: State, shown_px: int) -> dict[str, Any]:
    """All there is to show of a frame, with its picture as a JPEG of that longer side."""
    moment, known = state.moment, state.knowledge
    image, following = moment.glance.image, known.next_view
    return {
        "picture": base64.b64encode(encode_thumbnail(image.pixels, shown_px)).decode("ascii"),
        "size": image.size,
        "corners": _rounded(moment.glance.detection.pixels),
        "gauges": [[gauge.name, gauge.state, gauge.value] for gauge in moment.gauges],
        "advice": moment.advice,
        "taken": state.taken,
        "count": state.count,
        "new": state.new,
        "sigma_px": known.sigma_px if np.isfinite(known.sigma_px) else None,
        "goal_px": known.goal_px,
        "progress": known.progress,
        "why_not": known.why_not,
        "lacks": [lack.message for lack in known.lacks],
        "next": described(known.camera, known.board, following.pose) if following else "",
        "outline": _rounded(following.outline_px) if following else [],
    }


def _rounded(pixels: Pixels) -> list[list[float]]:
    known = pixels[np.isfinite(pixels).all(axis=1)]
    return [[round(float(x), 1), round(float(y), 1)] for x, y in known]
