"""The state of a capture as text: a live display on a terminal, one line for each photograph elsewhere."""

from types import TracebackType
from typing import TYPE_CHECKING

from rich.console import Console, Group, RenderableType
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table
from rich.text import Text
from typing_extensions import Self

from opencsp_calib.coach import sketch
from opencsp_calib.coach.wording import described
from opencsp_calib.synthetic import outline

if TYPE_CHECKING:
    from opencsp_calib.capture import Release, State

__all__ = ["LiveText"]

COLOURS = {"good": "green", "bad": "red", "unknown": "yellow"}
MARKS = {"good": "ok", "bad": "no", "unknown": "?"}
KEYS = {
    "coach": "the coach releases; space: release now   d: delete the last   q: stop",
    "interval": "releases by the clock; space: release now   d: delete the last   q: stop",
    "manual": "space or Enter: release   d: delete the last   q: stop",
}


class LiveText:
    """Shows states on standard error until its context is left."""

    def __init__(self, release: "Release") -> None:
        self._console = Console(stderr=True, highlight=False, markup=False, soft_wrap=True)
        self._keys = KEYS[release.by]
        self._live = Live(console=self._console, transient=True, auto_refresh=False)

    def __enter__(self) -> Self:
        if self._console.is_terminal:
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._live.stop()

    def say(self, text: str) -> None:
        """A line that stays."""
        self._console.print(text)

    def show(self, state: "State") -> None:
        """The state after a frame."""
        if state.new:
            sigma = state.knowledge.sigma_px
            known = f"; uncertainty before it {sigma:.2g} px" if sigma > 0 else ""
            corners = len(state.moment.glance.detection)
            self.say(f"{state.new}: {state.taken} of {state.count}, {corners} corners{known}")
        if self._console.is_terminal:
            self._live.update(self._picture(state), refresh=True)

    def _picture(self, state: "State") -> RenderableType:
        gauges = Table.grid(padding=(0, 2))
        for gauge in state.moment.gauges:
            mark = Text(MARKS[gauge.state], COLOURS[gauge.state])
            gauges.add_row(Text(gauge.name), mark, Text(gauge.value))
        sides = Table.grid(padding=(0, 3))
        sides.add_row(gauges, Text("\n".join(self._drawing(state))))
        return Group(Text(state.moment.advice, "bold"), sides, *self._set(state), Text(self._keys, "dim"))

    def _drawing(self, state: "State") -> list[str]:
        knowledge, moment, outlines = state.knowledge, state.moment, {}
        if knowledge.next_view:
            outlines["#"] = knowledge.next_view.outline_px
        if moment.pose:
            outlines["."] = knowledge.camera.project(moment.pose.transform(outline(knowledge.board)))
        return sketch(outlines, moment.glance.image.size)

    def _set(self, state: "State") -> list[RenderableType]:
        knowledge = state.knowledge
        lines: list[RenderableType] = []
        if knowledge.next_view:
            where = described(knowledge.camera, knowledge.board, knowledge.next_view.pose)
            lines.append(Text(f"next (#): {where}"))
        lines += [Text(f"missing: {lack.message}") for lack in knowledge.lacks]
        known = f"{knowledge.sigma_px:.2g} px" if knowledge.sigma_px > 0 else "not known yet"
        lines.append(Text(f"{state.taken} of {state.count}; uncertainty {known}, goal {knowledge.goal_px:g} px"))
        bar = Table.grid()  # a bar alone would not end its line
        bar.add_row(ProgressBar(total=1.0, completed=knowledge.progress, width=48))
        lines.append(bar)
        return lines
