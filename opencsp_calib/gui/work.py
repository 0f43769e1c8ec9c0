"""Long work in a process of its own, so that the page always answers, and so that it can be stopped at once.

The process runs `opencsp_calib.gui.jobs`. It is started before it is needed, because loading its libraries takes a
second; what it is asked and what it answers are lines of JSON; large results are files.
"""

import asyncio
import json
from collections.abc import AsyncIterator, Mapping
from contextlib import suppress
from typing import Any, cast

from opencsp_calib.errors import CalibError, CalibrationFailedError, CancelledError, InputError
from opencsp_calib.processes import BACKGROUND, own_process

__all__ = ["Worker"]

MAX_LINE = 2**26  # bytes of one answer
STOPPED = "stopped; nothing was changed"


class Worker:
    """One process, which does one job at a time."""

    def __init__(self) -> None:
        self._process: asyncio.subprocess.Process | None = None
        self._starting = asyncio.Lock()  # who asks while it is being started gets the same
        self._stopped = False

    async def start(self) -> asyncio.subprocess.Process:
        """Have the process ready."""
        async with self._starting:
            if self._process is None or self._process.returncode is not None:
                self._process = await asyncio.create_subprocess_exec(
                    *own_process("opencsp_calib.gui.jobs", background=True),
                    stdin=asyncio.subprocess.PIPE,
                    stdout=asyncio.subprocess.PIPE,
                    limit=MAX_LINE,
                    **BACKGROUND,
                )
            return self._process

    def begin(self) -> None:
        """Have jobs done from now on, until `stop`: work may be several jobs, and is stopped between them too."""
        self._stopped = False

    async def run(self, job: str, arguments: Mapping[str, Any]) -> AsyncIterator[dict[str, Any]]:
        """Do a job of `opencsp_calib.gui.jobs`.

        Yields
        ------
        dict
            What it tells on the way; last, what came of it, under ``done``.

        Raises
        ------
        CalibError
            If it failed, with the line for a person; CancelledError if it was stopped.
        """
        process = await self.start()
        if self._stopped:
            raise CancelledError(STOPPED)
        asking, answers = cast(asyncio.StreamWriter, process.stdin), cast(asyncio.StreamReader, process.stdout)
        with suppress(ConnectionError):  # it has died: the answer, which is none, says so
            asking.write(json.dumps({"job": job, **arguments}).encode() + b"\n")
            await asking.drain()
        while line := await answers.readline():
            answer: dict[str, Any] = json.loads(line)
            if "error" in answer:
                raise (
                    InputError(answer["error"]) if answer["exit_code"] == 2 else CalibrationFailedError(answer["error"])
                )
            yield answer
            if "done" in answer:
                return
        self._process = None
        if self._stopped:
            raise CancelledError(STOPPED)
        raise CalibError("the worker process ended unexpectedly (out of memory?); nothing was changed")

    def stop(self) -> None:
        """End what is being done, at once, and do no more of it."""
        self._stopped = True
        if self._process is not None:
            with suppress(ProcessLookupError):
                self._process.kill()
            self._process = None  # also before it is known to have ended
