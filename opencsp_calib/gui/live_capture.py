"""The capture of the window: one process at a time, whatever pages watch it."""

import asyncio
import json
from contextlib import suppress
from typing import Any

from nicegui import Event

from opencsp_calib.counted import counted
from opencsp_calib.gui.news import Message
from opencsp_calib.processes import own_process

__all__ = ["SHOWN_PX", "LiveCapture"]

SHOWN_PX = 960
"""The longer side of the live picture."""

MAX_LINE = 2**26  # bytes of one frame
NEXT = (
    "Calibrate these; then take a second set into another folder, and check the camera with it under Existing camera."
)


class LiveCapture:
    """Starts a capture, hands orders to it, and keeps what it last told."""

    def __init__(self) -> None:
        self.changed: Event[[]] = Event()
        self.frame: dict[str, Any] | None = None
        self.message = Message("Describe the board under Calibrate, then start.")
        self._process: asyncio.subprocess.Process | None = None
        self._begun = False  # from the click on, before there is a process: a second click must not start another
        self._reading: asyncio.Task[None] | None = None

    @property
    def running(self) -> bool:
        """Whether a capture goes on."""
        return self._begun

    async def start(self, **asked: Any) -> None:
        """Begin a capture; the arguments are those of `opencsp_calib.capture.prepared`, settings as a list of texts."""
        if self.running:
            return
        self._begun, self.frame, self.message = True, None, Message("Starting the camera …")
        self.changed.emit()
        self._process = await asyncio.create_subprocess_exec(
            *own_process("opencsp_calib.gui.capture_job"),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            limit=MAX_LINE,
        )
        self.order(json.dumps({**asked, "shown_px": SHOWN_PX}))
        self._reading = asyncio.get_running_loop().create_task(self._read(self._process))
        self.changed.emit()

    def order(self, line: str) -> None:
        """Have it ``press``, ``delete`` or ``stop``; nothing where no capture goes on."""
        if self._process is not None and self._process.stdin is not None:
            with suppress(ConnectionError):  # it has just ended
                self._process.stdin.write(line.encode() + b"\n")

    def close(self) -> None:
        """End it at once; the photographs taken are whole."""
        if self._process is not None:
            with suppress(ProcessLookupError):
                self._process.kill()

    async def _read(self, process: asyncio.subprocess.Process) -> None:
        answers = process.stdout
        assert answers is not None  # noqa: S101  # a pipe was asked for
        ended = Message("The capture ended unexpectedly; the photographs taken are safe.", "bad")
        while line := await answers.readline():
            answer: dict[str, Any] = json.loads(line)
            if "frame" in answer:
                self.frame = answer["frame"]
                if self.frame["new"]:
                    self.message = Message(f"{self.frame['new']} taken.", "good")
            elif "say" in answer:
                self.message = Message(answer["say"])
            elif "done" in answer:
                ended = Message(f"{counted(answer['done'], 'photograph is', 'photographs are')} taken. {NEXT}", "good")
            else:
                ended = Message(answer["error"], "bad")
            self.changed.emit()
        await process.wait()
        self._begun, self._process, self.message = False, None, ended
        self.changed.emit()
