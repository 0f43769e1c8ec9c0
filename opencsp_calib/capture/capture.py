"""A capture: every frame is looked at and judged, and photographed when it is time; the faces only show its state."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

from opencsp_calib.capture.folder import CaptureFolder
from opencsp_calib.capture.learner import Learner
from opencsp_calib.capture.learning import Study
from opencsp_calib.capture.release import Release
from opencsp_calib.coach import Knowledge, Moment, Preview, judge_moment
from opencsp_calib.detection import Detection
from opencsp_calib.errors import InputError
from opencsp_calib.image import Image
from opencsp_calib.information import GOAL_PX
from opencsp_calib.looking import Search
from opencsp_calib.pose import Pose

__all__ = ["Capture", "State"]


@dataclass(frozen=True, eq=False)
class State:
    """What there is to show after a frame.

    Parameters
    ----------
    moment : Moment
        Of this frame.
    knowledge : Knowledge
        From the photographs taken.
    taken, count : int
        Photographs there are, and how many there shall be.
    new : str
        Name of the photograph that this frame became; empty if it was not taken.
    """

    moment: Moment = field(repr=False)
    knowledge: Knowledge
    taken: int
    count: int
    new: str = ""


class Capture:
    """Takes photographs into a folder.

    Parameters
    ----------
    folder : CaptureFolder
    search : Search
        For the board.
    release : Release
    count : int
        Photographs that there shall be in the folder, those of an earlier run included. Released by the coach, it ends
        before, when the uncertainty has reached its goal and nothing is lacking.
    range_m : float, optional
        The working range of the camera; None for infinity.
    goal_px : float
        The uncertainty of projections to reach.
    clock : callable
        Seconds.
    """

    def __init__(
        self,
        folder: CaptureFolder,
        search: Search,
        release: Release,
        count: int,
        *,
        range_m: float | None = None,
        goal_px: float = GOAL_PX,
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.folder, self.search, self.release, self.count = folder, search, release, count
        self._range_m, self._goal_px, self._clock = range_m, goal_px, clock
        self._preview = Preview(search.board, search.detector)
        self._learner: Learner | None = None
        self._places: list[Detection] = []  # of the board in the photographs of this run
        self._glimpsed: list[Pose] = []  # of the board in photographs that the coach has not learnt from yet
        self._last_s = float("-inf")
        self._sources = folder.sources
        self._pressed, self._stopped, self._deleting = threading.Event(), threading.Event(), threading.Event()

    def press(self) -> None:
        """Release by hand: the next frame is taken, whatever the coach thinks."""
        self._pressed.set()

    def stop(self) -> None:
        """End after the frame that is looked at."""
        self._stopped.set()

    def delete_last(self) -> None:
        """Delete the last photograph before the next frame is looked at."""
        self._deleting.set()

    @property
    def behind(self) -> bool:
        """Whether there are photographs that the coach has not learnt from yet."""
        return self._learner is not None and self._learner.behind

    def run(self, images: Iterator[Image], show: Callable[[State], None]) -> Knowledge | None:
        """Go through the images of a source until it is done, stopped, or there are no more.

        Parameters
        ----------
        images : iterator of Image
        show : callable
            Called with the state after every frame.

        Returns
        -------
        Knowledge or None
            From all photographs; None where there was no image at all.

        Raises
        ------
        InputError
            If a photograph cannot be written, the image size changes, or the source fails; all taken before are safe.
        """
        try:
            if len(self.folder.images) < self.count:
                for image in images:
                    state = self._step(image)
                    show(state)
                    if self._is_over(state):
                        break
                self._delete_if_asked()  # while the last frame was looked at
            return self._learner.wait() if self._learner else None
        finally:
            if self._learner:
                self._learner.close()

    def _is_over(self, state: State) -> bool:
        by_coach = self.release.by == "coach" and state.knowledge.done
        return self._stopped.is_set() or state.taken >= state.count or by_coach

    def _step(self, image: Image) -> State:
        learner = self._learner = self._learner or self._begun(image)
        expected = learner.knowledge.camera.image_size
        if image.size != expected:
            sizes = " but those before were ".join("x".join(map(str, size)) for size in (image.size, expected))
            raise InputError(f"the images are {sizes}: the camera's region or binning has changed; use another folder")
        self._delete_if_asked()
        moment = judge_moment(self._preview.look(image), self._known(learner), self._places)
        new = self._photographed(image, moment, learner) if self._is_due(image, moment) else ""
        return State(moment, learner.knowledge, len(self.folder.images), self.count, new)

    def _known(self, learner: Learner) -> Knowledge:
        """With the photographs that it has not learnt from yet counted by where the board seemed to be."""
        if not learner.behind:
            self._glimpsed.clear()
        known = learner.knowledge
        for pose in self._glimpsed:
            known = known.having_seen(pose)
        return known

    def _is_due(self, image: Image, moment: Moment) -> bool:
        since_s = self._clock() - self._last_s
        due = self.release.due(right=moment.right, pressed=self._pressed.is_set(), since_s=since_s)
        return due and image.sha256 not in self._sources

    def _photographed(self, image: Image, moment: Moment, learner: Learner) -> str:
        self._pressed.clear()
        self._last_s = self._clock()
        name = self.folder.add(image).name
        self._places.append(moment.glance.detection)
        self._glimpsed += [moment.pose] if moment.pose else []
        learner.know(self.folder.images)
        return name

    def _begun(self, image: Image) -> Learner:
        learner = Learner(Study(self.search, image.size, self._range_m, self._goal_px))
        if self.folder.images:  # of a run before
            learner.know(self.folder.images)
            self._places = [view.detection for view in learner.wait().views]
        return learner

    def _delete_if_asked(self) -> None:
        if self._learner is None or not self._deleting.is_set():
            return
        self._deleting.clear()
        if self.folder.remove_last() and self._places:
            self._places.pop()
        self._learner.know(self.folder.images)
