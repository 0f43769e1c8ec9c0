"""What a session is on the disk, and how tomorrow goes on from it.

::

    DIR/opencsp-calib-session/
        session.json         settings, where the photographs are, what was left out
        photographs/         those that came by upload
        thumbnails/
        observations.hdf5    of the last search for corners     (our own files, see `hdf5_calibration`; named so that
        calibration.hdf5     of the last calibration            they are not taken for camera files of the user's)
        before.hdf5          of the one before
        found.journal        what was found in each photograph, so that a search goes on where it was stopped
"""

import json
from contextlib import suppress
from typing import TYPE_CHECKING, Any

from opencsp_calib.atomic import replacing
from opencsp_calib.errors import InputError
from opencsp_calib.gui.described import described
from opencsp_calib.gui.files import shown
from opencsp_calib.gui.news import Message
from opencsp_calib.gui.settings import Settings
from opencsp_calib.hdf5_calibration import load_calibration, load_observations

if TYPE_CHECKING:
    from opencsp_calib.gui.session import Session

__all__ = ["read_session", "write_session"]

VERSION = 1


def write_session(session: "Session") -> None:
    """Write the session file.

    Raises
    ------
    InputError, OSError
        If it cannot be written.
    """
    content = {
        "version": VERSION,
        "settings": session.settings.as_json(),
        "sources": session.selection.sources,
        "kept": session.kept,
        "found_with": session.found_with,
        "solved_with": session.solved_with,
        "removed": sorted(session.removed),
    }
    with replacing(session.file("session", "json")) as temporary:
        temporary.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def read_session(session: "Session") -> None:
    """Go on from where it was left, if there is such a file; what is wrong with it becomes the session's message."""
    path = session.own / "session.json"
    if not path.is_file():
        return
    try:
        wrong = _take(session, json.loads(path.read_text(encoding="utf-8")))
    except (InputError, OSError, ValueError, KeyError, TypeError) as error:
        aside = path.with_name("session-not-read.json")  # or the next change would write over it
        with suppress(OSError):
            path.replace(aside)
        text = f"The session kept in {shown(session.folder, path)} cannot be read: {error}. A new one begins"
        session.message = Message(f"{text}; the other is kept as {aside.name}.", "bad")
        return
    try:
        _read_results(session)
    except (InputError, OSError) as error:
        wrong = (*wrong, f"What was found cannot be read: {error}")
    session.message = Message("; ".join(("Going on from where you left.", *wrong)), "bad" if wrong else "info")


def _take(session: "Session", content: Any) -> tuple[str, ...]:
    """Take all of it, or nothing; what is wrong with the photographs."""
    if content["version"] != VERSION:
        raise InputError(f"it is of version {content['version']}, and this program knows version {VERSION}")
    settings = Settings.from_json(content["settings"])
    sources, removed = (tuple(map(str, content[name])) for name in ("sources", "removed"))
    kept, found_with, solved_with = str(content["kept"]), content["found_with"], content["solved_with"]
    session.settings, session.kept, session.removed = settings, kept, frozenset(removed)
    session.found_with, session.solved_with = found_with, solved_with
    session.selection.sources = sources
    return session.selection.look_up()


def _read_results(session: "Session") -> None:
    if session.file("observations").exists():
        session.observations = load_observations(session.file("observations"))
        session.views = described(session.observations)
    if session.file("calibration").exists():
        session.calibration = load_calibration(session.file("calibration"))
    if session.file("before").exists():
        session.before = load_calibration(session.file("before"))
