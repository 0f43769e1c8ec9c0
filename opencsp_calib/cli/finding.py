"""Finding corners for a command: with progress, what became of the images, and a journal to go on from."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from opencsp_calib.cli.console import detection_progress, say, say_unused
from opencsp_calib.counted import counted
from opencsp_calib.errors import CalibError, CancelledError, InputError

if TYPE_CHECKING:
    from opencsp_calib.board import Board
    from opencsp_calib.detection import Observations
    from opencsp_calib.journal import Journal

__all__ = ["detected_aloud", "kept_beside"]


@contextmanager
def kept_beside(output: Path | None, resume: bool) -> "Iterator[Journal | None]":
    """A journal beside the output, for as long as the command has not written it; none without an output.

    It stays when the command is stopped or killed, and, where ``--resume`` was given, when it fails: then the work may
    still be wanted.
    """
    if output is None:
        if resume:
            raise InputError("--resume needs -o FILE: what is done is kept beside it, in FILE.journal")
        yield None
        return
    from opencsp_calib.journal import Journal, journal_beside

    journal = Journal(journal_beside(output), resume=resume)
    try:
        yield journal
    except (KeyboardInterrupt, CancelledError) as error:
        if not journal.path.exists():  # stopped before anything was done
            raise
        what = str(error) or "stopped"
        raise CancelledError(f"{what}; what is done is kept in {journal.path}: --resume goes on from there") from None
    except CalibError:
        if not resume:
            journal.remove()
        raise
    journal.remove()


def detected_aloud(images: list[str], board: "Board", journal: "Journal | None" = None, **how: Any) -> "Observations":
    """What is seen in photographs; `how` as for `opencsp_calib.pipeline.detect`."""
    from opencsp_calib import pipeline

    with detection_progress() as progress:
        observations = pipeline.detect(images, board, progress=progress, journal=journal, **how)
    if journal and journal.taken:
        say(
            f"{journal.taken} of {counted(len(observations.views), 'image')} had been looked at before ({journal.path})"
        )
    if journal and journal.foreign:
        say(f"not used, of other settings or versions: {counted(journal.foreign, 'result')} in {journal.path}")
    say_unused(observations)
    return observations
