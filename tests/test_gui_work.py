"""The window's work, in a process of its own: begun, stopped and begun again at any moment."""

import asyncio
from collections.abc import Coroutine
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("nicegui")

from opencsp_calib.errors import CancelledError, InputError
from opencsp_calib.gui.asking import may_forget
from opencsp_calib.gui.news import Progress
from opencsp_calib.gui.session import Session
from opencsp_calib.gui.work import Worker

NOTHING = {"where": "/no/such/folder", "given": {}}  # what the job `fleet` is quick to answer


def done(scene: Coroutine[Any, Any, Any]) -> Any:
    """What comes of it, but not for ever."""
    return asyncio.run(asyncio.wait_for(scene, 240))


async def ended(worker: Worker) -> None:
    """Its process too, before the loop that watches it."""
    process = await worker.start()
    worker.stop()
    await process.communicate()


async def answered(worker: Worker) -> list[Any]:
    return [answer async for answer in worker.run("fleet", NOTHING)]


def test_who_asks_for_the_process_while_it_is_started_gets_the_same() -> None:
    """A click on the next step comes while the process that was stopped is started anew."""

    async def scene() -> bool:
        worker = Worker()
        one, other = await asyncio.gather(worker.start(), worker.start())
        await ended(worker)
        if one is not other:
            one.kill()
            await one.communicate()
        return one is other

    assert done(scene())


def test_it_is_stopped_while_the_process_is_started() -> None:
    async def scene() -> None:
        worker = Worker()
        running = asyncio.create_task(answered(worker))
        await asyncio.sleep(0)
        worker.stop()
        with pytest.raises(CancelledError):
            await running
        worker.begin()
        with pytest.raises(InputError, match="/no/such/folder"):  # it is at work again
            await answered(worker)
        await ended(worker)

    done(scene())


def test_work_of_several_jobs_is_stopped_between_them(tmp_path: Path) -> None:
    async def scene() -> list[str]:
        session = Session(tmp_path)
        said = []

        async def second_job() -> None:
            await session.job("fleet", **NOTHING)

        async def stopped_before_it() -> None:
            session.cancel()
            await second_job()

        for work in (stopped_before_it, second_job):
            assert not await session.start("Working", work)
            said.append(session.message.text)
        await ended(session.worker)
        return said

    stopped, after_it = done(scene())
    assert stopped == "stopped; nothing was changed"
    assert "/no/such/folder" in after_it


def test_photographs_are_not_forgotten_while_work_with_them_goes_on(tmp_path: Path) -> None:
    """Begun on another page while this one had not heard of it."""

    async def scene() -> tuple[bool, str]:
        session = Session(tmp_path)
        session.progress = Progress("Finding corners")
        forgotten = await may_forget(session)
        return forgotten, session.message.text

    assert done(scene()) == (False, "Wait until what goes on is done, or cancel it.")
