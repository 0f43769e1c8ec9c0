"""A view as JSON, but for its corners, which are arrays: as camera files and journals keep it."""

from collections.abc import Iterable, Mapping
from typing import Any, get_args

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.detection import Detection, Problem, RejectedCorner, Status, View
from opencsp_calib.errors import FileFormatError

__all__ = ["OPTIONAL", "restored_problems", "restored_view", "stored_problems", "stored_view"]

OPTIONAL = {"covariance": (2, 2), "edge_width_px": (), "contrast": ()}
"""What a detection may or may not know of its corners, with its shape for one corner."""


def stored_view(view: View) -> dict[str, Any]:
    """Everything of a view but the arrays of its detection."""
    rejected = [[corner.id, *corner.pixel, corner.reason] for corner in view.detection.rejected]
    return {
        "image": view.image,
        "sha256": view.sha256,
        "status": view.status,
        "problems": stored_problems(view.problems),
        "reason": view.detection.reason,
        "rejected": rejected,
    }


def restored_view(entry: Mapping[str, Any], arrays: Mapping[str, Floats | None]) -> View:
    """The view again, with the arrays of its detection: ``ids``, ``pixels`` and those of `OPTIONAL`.

    Raises
    ------
    FileFormatError
        If the status is none.
    """
    if entry["status"] not in get_args(Status):
        raise FileFormatError(f"the view {entry['image']!r} has the unknown status {entry['status']!r}")
    rejected = tuple(RejectedCorner(int(i), (float(x), float(y)), str(why)) for i, x, y, why in entry["rejected"])
    known: dict[str, Any] = {name: arrays[name] for name in OPTIONAL}
    detection = Detection(
        np.asarray(arrays["ids"]).astype(np.int64),
        np.asarray(arrays["pixels"]),
        **known,
        rejected=rejected,
        reason=str(entry["reason"]),
    )
    problems = restored_problems(entry["problems"])
    return View(str(entry["image"]), detection, entry["status"], problems, str(entry["sha256"]))


def stored_problems(problems: Iterable[Problem]) -> list[list[str]]:
    """Codes and messages."""
    return [[problem.code, problem.message] for problem in problems]


def restored_problems(entries: list[list[str]]) -> tuple[Problem, ...]:
    """The problems again."""
    return tuple(Problem(str(code), str(message)) for code, message in entries)
