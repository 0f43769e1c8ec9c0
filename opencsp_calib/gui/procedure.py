"""The two long steps of the procedure: finding the corners, and calibrating, with all images or without some."""

import asyncio
from collections.abc import Iterable
from functools import partial

from opencsp_calib.counted import counted
from opencsp_calib.gui.described import described
from opencsp_calib.gui.files import within
from opencsp_calib.gui.news import Level, Message
from opencsp_calib.gui.session import Session
from opencsp_calib.hdf5_calibration import load_calibration, load_observations

__all__ = ["calibrate", "find_and_calibrate", "find_corners", "put_back", "remove"]

LEVELS: dict[str, Level] = {"good": "good", "doubt": "info", "bad": "bad"}


def find_corners(session: Session) -> None:
    """Look for the board in all photographs; where some are gone since they were selected, this is said first."""
    selected = session.selection.paths
    wrong = session.selection.look_up()
    there = set(session.selection.paths.values())
    if gone := [name for name, path in selected.items() if path not in there]:
        text = f"No longer there: {', '.join(gone)}. Find the corners of the others, or select photographs again."
        session.say("; ".join((*wrong, text)), "bad")
        return
    session.start("Finding corners", partial(_find_corners, session), len(session.selection.files))


def calibrate(session: Session) -> None:
    """Solve for the camera from all views that are not removed."""
    _calibrate_without(session, session.removed)


def find_and_calibrate(session: Session) -> None:
    """Both steps, one after the other."""

    async def both() -> None:
        await _find_corners(session)
        await _calibrate(session, session.removed)

    session.start("Finding corners and calibrating", both, len(session.selection.files))


def remove(session: Session, names: Iterable[str]) -> None:
    """Leave images out, and calibrate again; they stay in where that fails."""
    _calibrate_without(session, session.removed | set(names))


def put_back(session: Session, names: Iterable[str]) -> None:
    """Take images in again, and calibrate again; they stay out where that fails."""
    _calibrate_without(session, session.removed - set(names))


async def _find_corners(session: Session) -> None:
    asked, target = session.asked(), session.file("observations")
    session.views, session.looking = {}, True
    try:
        await session.job(
            "find_corners",
            images=[str(file.path) for file in session.selection.files],
            board=session.board,
            options=session.settings.finding,
            observations=str(target),
            journal=str(session.file("found", "journal")),
            thumbnails=str(session.thumbnails.folder),
        )
        found = await asyncio.to_thread(load_observations, target)
        session.observations, session.found_with = found, asked
    finally:
        session.looking = False
        session.views = await asyncio.to_thread(described, session.observations)
    session.removed &= {view.image for view in found.views}
    text = f"The board is found in {len(found.used)} of {counted(len(found.views), 'photograph')}."
    session.message = Message(text, "good" if found.used else "bad")


def _calibrate_without(session: Session, removed: frozenset[str]) -> None:
    session.start("Calibrating", partial(_calibrate, session, removed))


async def _calibrate(session: Session, removed: frozenset[str]) -> None:
    settings, target, new = session.settings, session.file("calibration"), session.file("new")
    asked = session.asked_to_solve(removed)
    options = {
        "name": settings.camera_name.strip() or "camera",
        "record": settings.record,
        "provenance": session.selection.provenance(),
    }
    judged = await session.job(
        "solve",
        observations=str(session.file("observations")),
        exclude=sorted(removed),
        options=settings.solving | options,
        guess=settings.guess and str(within(session.folder, settings.guess)),
        calibration=str(new),
        **settings.leaving_out,
    )
    if target.exists():
        target.replace(session.file("before"))
    new.replace(target)
    solved = await asyncio.to_thread(load_calibration, target)
    session.before, session.calibration = session.calibration, solved
    session.removed, session.solved_with = removed, asked
    text = f"Calibrated from {len(solved.observations.used)} views, rms {solved.rms_px:.4f} px. {judged['sentence']}"
    session.message = Message(text, LEVELS[judged["level"]])
