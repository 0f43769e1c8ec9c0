"""What has been chosen and found so far: one for the window, whatever pages show it, kept in a folder below DIR.

Every page shows the same session and is told when it changes, so that a reload, a second tab or a lost connection lose
nothing; nor does a restart, because all of it is on the disk (`session_file.py`).
"""

import asyncio
from collections.abc import Callable, Coroutine
from dataclasses import replace
from pathlib import Path
from typing import Any

from nicegui import Event

from opencsp_calib.calibration import Calibration
from opencsp_calib.counted import counted
from opencsp_calib.detection import Observations
from opencsp_calib.errors import CalibError, InputError
from opencsp_calib.gui.board_text import board_text
from opencsp_calib.gui.live_capture import LiveCapture
from opencsp_calib.gui.news import Level, Message, Progress
from opencsp_calib.gui.offered import Offered
from opencsp_calib.gui.selection import Selection
from opencsp_calib.gui.session_file import read_session, write_session
from opencsp_calib.gui.settings import FILE, Settings
from opencsp_calib.gui.thumbnails import Thumbnails
from opencsp_calib.gui.work import Worker

__all__ = ["FOLDER", "Session"]

FOLDER = "opencsp-calib-session"
PAUSE_S = 0.5  # between two news to the pages while work goes on: a browser draws a table at the work's cost


class Session:
    """The state of the window, and what can be done next.

    Parameters
    ----------
    folder : Path
        Below which all files are.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder.resolve()
        self.own = self.folder / FOLDER
        self.changed: Event[[]] = Event()
        self.worker = Worker()
        self.capture = LiveCapture()
        self.offered: Offered | None = None
        self.settings = Settings()
        self.selection = Selection(self.folder, self.own / "photographs")
        self.thumbnails = Thumbnails(self.own / "thumbnails")
        self.kept = ""  # the file that corners were taken up from, in the place of photographs
        self.views: dict[str, dict[str, Any]] = {}  # by image, as `summary.view_as_json`
        self.looking = False  # whether the board is being looked for: views come in
        self.found_with: list[Any] = []
        self.solved_with: list[Any] = []
        self.observations: Observations | None = None
        self.removed: frozenset[str] = frozenset()
        self.calibration: Calibration | None = None
        self.before: Calibration | None = None
        self.progress: Progress | None = None
        self.message = Message("Describe the board and select photographs.")
        self._news: asyncio.TimerHandle | None = None
        self._writing: asyncio.TimerHandle | None = None
        self._works: set[asyncio.Task[bool]] = set()
        read_session(self)

    # --- what makes sense now ---

    @property
    def busy(self) -> bool:
        """Whether work goes on."""
        return self.progress is not None

    @property
    def board(self) -> str:
        """The board, as `pipeline.board_from` takes it; empty while the fields describe none."""
        try:
            return board_text(self.settings, self.folder)
        except InputError:
            return ""

    @property
    def can_find(self) -> bool:
        """Whether there is something to look for, and photographs to look at."""
        chosen = self.selection
        return bool(chosen.files) and not chosen.receiving and not self.busy and bool(self.board)

    @property
    def is_found(self) -> bool:
        """Whether what was found is what the settings and photographs of now would give."""
        return self.observations is not None and self.found_with == self.asked()

    @property
    def is_solved(self) -> bool:
        """Whether the calibration is of what was found, chosen and left out now."""
        return self.calibration is not None and self.solved_with == self.asked_to_solve(self.removed)

    @property
    def can_calibrate(self) -> bool:
        """Whether corners are found."""
        return self.is_found and not self.busy and any(v["status"] == "used" for v in self.views.values())

    # --- what a person does ---

    def choose(self, setting: str, value: Any) -> None:
        """Change a setting."""
        if getattr(self.settings, setting) != value:
            self.settings = replace(self.settings, **{setting: value})
            self.tell()

    def say(self, text: str, level: Level = "info") -> None:
        """Put a line in the status."""
        self.message = Message(text, level)
        self.tell()

    def forget_photographs(self) -> None:
        """Start again with none, and with no results."""
        self.views, self.removed, self.kept = {}, frozenset(), ""
        self.found_with, self.solved_with = [], []
        self.observations = self.calibration = self.before = None
        for name in ("observations.hdf5", "calibration.hdf5", "before.hdf5", "found.journal"):
            (self.own / name).unlink(missing_ok=True)
        self.selection.clear()
        self.say("Select photographs.")

    def end_batch(self, batch: str) -> None:
        """No more photographs of this batch of uploads will come."""
        if self.selection.end(batch):
            self.say(f"{counted(len(self.selection.files), 'photograph')} selected.")

    def cancel(self) -> None:
        """Stop the work that goes on."""
        self.worker.stop()

    async def ask_plugins(self) -> None:
        """Find out what they offer, if it is not known yet."""
        if self.offered is None:
            self.offered = await asyncio.to_thread(Offered.here)
            self.changed.emit()

    # --- telling and keeping ---

    def tell(self) -> None:
        """Tell all pages, and keep it all soon."""
        self.changed.emit()
        if self._writing is None:
            self._writing = asyncio.get_running_loop().call_later(1.0, self.keep)

    def tell_soon(self) -> None:
        """Tell all pages, but not more often than they can follow."""
        if self._news is None:
            self._news = asyncio.get_running_loop().call_later(PAUSE_S, self._tell_now)

    def keep(self) -> None:
        """Write the session file."""
        self._writing = None
        try:
            write_session(self)
        except (InputError, OSError) as error:
            self.message = Message(f"This session cannot be kept: {error}", "bad")
            self.changed.emit()

    def close(self) -> None:
        """Keep all, and end the work."""
        self.keep()
        self.worker.stop()
        self.capture.close()

    def _tell_now(self) -> None:
        self._news = None
        self.changed.emit()

    def file(self, name: str, extension: str = "hdf5") -> Path:
        """One of the session's own files."""
        self.own.mkdir(exist_ok=True)
        return self.own / f"{name}.{extension}"

    # --- the work ---

    def start(self, what: str, work: Callable[[], Coroutine[Any, Any, None]], total: int = 0) -> asyncio.Task[bool]:
        """Begin long work, unless some goes on; what goes wrong with it is said in the status.

        Returns
        -------
        asyncio.Task
            Gives whether it was done. Nobody need wait for it.
        """
        task = asyncio.get_running_loop().create_task(self._run(what, work, total))
        self._works.add(task)  # the loop itself would forget it
        task.add_done_callback(self._works.discard)
        return task

    async def job(self, name: str, **arguments: Any) -> Any:
        """Have a job of `jobs.py` done, showing its progress; gives what came of it. To be called by work."""
        result = None
        async for answer in self.worker.run(name, arguments):
            if "view" in answer:
                self.views[answer["view"]["image"]] = answer["view"]
            if "total" in answer and self.progress:
                self._advance(answer.get("what", self.progress.what), answer["done_images"], answer["total"])
                self.tell_soon()
            result = answer.get("done")
        return result

    def _advance(self, what: str, done: int, total: int) -> None:
        if self.progress is None or what != self.progress.what:
            self.progress = Progress(what)  # its time left is counted anew
        self.progress = replace(self.progress, done=done, total=total)

    async def _run(self, what: str, work: Callable[[], Coroutine[Any, Any, None]], total: int) -> bool:
        if self.busy:
            return False
        self.progress = Progress(what, total=total)
        self.worker.begin()
        self.tell()
        try:
            await work()
        except (CalibError, OSError) as error:
            self.message = Message(str(error), "bad")
            return False
        except Exception as error:  # a defect of ours: said, and the window lives on
            self.message = Message(f"unexpected: {error!r}", "bad")
            raise
        finally:
            self.progress = None
            self.tell()
            await self.worker.start()  # ready again, if it was stopped
        return True

    def asked(self) -> list[Any]:
        """What decides what is found."""
        if self.kept and not self.selection.files:
            return [self.kept]
        board = self.board
        changed = Path(board).stat().st_mtime_ns if board and self.settings.board_kind == FILE else 0
        return [board, changed, self.settings.finding, [str(file.path) for file in self.selection.files]]

    def asked_to_solve(self, removed: frozenset[str]) -> list[Any]:
        """What decides what is solved for: the corners found, views left out, and what is typed and chosen."""
        return [self.found_with, sorted(removed), self.settings.as_json()]
