"""Gauges of one frame, and whether this is the moment for a photograph: board held still, seen well, something new."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from opencsp_calib.coach.knowledge import Knowledge
from opencsp_calib.coach.lacking import TILT_ALLOWED_DEG
from opencsp_calib.coach.preview import Glance
from opencsp_calib.coach.wording import tilted_side
from opencsp_calib.detection import Detection
from opencsp_calib.pose import Pose
from opencsp_calib.quality import held, range_of

__all__ = ["Gauge", "Moment", "judge_moment"]

STILL = 0.0015  # of the image's longer side a frame: blurs little even where the exposure is as long as the frame
NEW_PLACE = 0.03  # of the image's diagonal: nearer to a photograph taken, it is the same one again
WHOLE = {"checkerboard": 1.0}
WHOLE_OTHERWISE = 0.7  # of the corners: ids tell a ChArUco board's parts apart
BY_PROBLEM = {
    "motion-blur": "sharp",
    "out-of-focus": "sharp",
    "squares-too-small": "size",
    "low-contrast": "light",
    "clipped": "light",
    "glare": "light",
    "shadow": "light",
    "at-border": "board",
    "corners-rejected": "board",
}


@dataclass(frozen=True)
class Gauge:
    """One thing to get right.

    Parameters
    ----------
    name : str
        ``board``, ``tilt``, ``still``, ``sharp``, ``light``, ``size`` or ``new``.
    state : 'good', 'bad' or 'unknown'
    value : str
        What it is now.
    advice : str
        What to do; empty where it is good.
    """

    name: str
    state: Literal["good", "bad", "unknown"]
    value: str
    advice: str = ""


@dataclass(frozen=True, eq=False)
class Moment:
    """One frame, judged.

    Parameters
    ----------
    glance : Glance
    pose : Pose, optional
        Of the board, roughly.
    gain : float
        What a photograph now would take away of the uncertainty, as a part; NaN where there is no pose.
    gauges : tuple of Gauge
    """

    glance: Glance = field(repr=False)
    pose: Pose | None
    gain: float
    gauges: tuple[Gauge, ...]

    @property
    def right(self) -> bool:
        """Whether to take it now."""
        return all(gauge.state == "good" for gauge in self.gauges)

    @property
    def advice(self) -> str:
        """The first thing to do; that this is the moment, if there is none."""
        return next((gauge.advice for gauge in self.gauges if gauge.state != "good"), "hold it: this is the moment")


def judge_moment(glance: Glance, knowledge: Knowledge, taken: Sequence[Detection] = ()) -> Moment:
    """What there is to say about a frame.

    Parameters
    ----------
    glance : Glance
    knowledge : Knowledge
        From the photographs taken.
    taken : sequence of Detection
        The board in each of them: what is there already is not new.
    """
    detection = glance.detection
    board = _board(glance, knowledge)
    if not len(detection):
        unknown = ("tilt", "still", "sharp", "light", "size", "new")
        return Moment(glance, None, float("nan"), (board, *(Gauge(name, "unknown", "") for name in unknown)))
    pose = knowledge.pose_of(detection)
    gain = knowledge.gain_of(pose) if pose else float("nan")
    return Moment(
        glance,
        pose,
        gain,
        (
            board,
            _tilt(knowledge, pose),
            _still(glance),
            _by_problem("sharp", "sharp", glance),
            _by_problem("light", "even", glance),
            _by_problem("size", f"{range_of(knowledge.board, pose):.2f} m away" if pose else "", glance),
            _new(glance, knowledge, gain, taken),
        ),
    )


def _board(glance: Glance, knowledge: Knowledge) -> Gauge:
    found, total = len(glance.detection), len(knowledge.board.points)
    if not found:
        return Gauge("board", "bad", "not found", f"show the whole board: {glance.detection.reason}")
    if found < WHOLE.get(knowledge.board.kind, WHOLE_OTHERWISE) * total:
        return Gauge("board", "bad", f"{found} of {total} corners", "bring the whole board into view")
    return _by_problem("board", "whole", glance)


def _tilt(knowledge: Knowledge, pose: Pose | None) -> Gauge:
    if pose is None:
        return Gauge("tilt", "unknown", "", "show more of the board")
    low, high = TILT_ALLOWED_DEG
    value = f"{pose.tilt_deg:.0f} degrees, {held(knowledge.board, pose)}"
    if pose.tilt_deg < low:
        return Gauge("tilt", "bad", value, "tilt the board more: 30 to 45 degrees")
    if pose.tilt_deg > high:
        side = tilted_side(knowledge.board, pose)
        return Gauge("tilt", "bad", value, f"tilt the board less: 30 to 45 degrees (its {side} is too far away)")
    return Gauge("tilt", "good", value)


def _still(glance: Glance) -> Gauge:
    if not np.isfinite(glance.motion_px):
        return Gauge("still", "unknown", "", "hold the board still")
    value = f"{glance.motion_px:.1f} px a frame"
    if glance.motion_px > STILL * max(glance.image.size):
        return Gauge("still", "bad", value, "hold the board still")
    return Gauge("still", "good", value)


def _by_problem(name: str, good: str, glance: Glance) -> Gauge:
    problem = next((p for p in glance.problems if BY_PROBLEM.get(p.code) == name), None)
    return Gauge(name, "bad", problem.code, problem.message) if problem else Gauge(name, "good", good)


def _new(glance: Glance, knowledge: Knowledge, gain: float, taken: Sequence[Detection]) -> Gauge:
    nearest = min((_apart(glance.detection, other) for other in taken), default=float("inf"))
    if nearest < NEW_PLACE * float(np.hypot(*glance.image.size)):
        return Gauge("new", "bad", "taken", "taken; move on to the next view")
    if not np.isfinite(gain):
        return Gauge("new", "unknown", "", "show more of the board")
    value = f"{gain:.0%} less uncertain"
    if not knowledge.adds(gain):
        return Gauge("new", "bad", value, "this view would add little: go where the drawing shows")
    return Gauge("new", "good", value)


def _apart(one: Detection, other: Detection) -> float:
    """Rms distance of the corners that both have, px; infinite where they have hardly any in common."""
    _, first, second = np.intersect1d(one.ids, other.ids, assume_unique=True, return_indices=True)
    if len(first) < 4:
        return float("inf")
    return float(np.sqrt(((one.pixels[first] - other.pixels[second]) ** 2).sum(axis=1).mean()))
