"""Corners kept in a file, taken up to be solved again: what ``solve FILE`` does."""

from dataclasses import replace
from pathlib import Path
from typing import Any

from opencsp_calib.board import Board, CharucoBoard, Checkerboard
from opencsp_calib.errors import CalibError
from opencsp_calib.gui.described import described
from opencsp_calib.gui.files import shown
from opencsp_calib.gui.session import Session
from opencsp_calib.hdf5_calibration import load_calibration, load_observations, save_observations
from opencsp_calib.hdf5_reading import EXTENSIONS
from opencsp_calib.registry import installed

__all__ = ["is_kept", "take_up"]

OF_SOLVING = ("model", "solver", "board_shape", "pixel_aspect", "weights")


def is_kept(path: Path) -> bool:
    """Whether a path is that of a file which may hold corners, by its name."""
    return path.is_file() and path.suffix.lower() in EXTENSIONS


def take_up(session: Session, path: Path) -> None:
    """Put the corners in an observations or camera file in the place of photographs; choose what they were solved by.

    Raises
    ------
    InputError
        If the file holds none.
    """
    found = load_observations(path)
    chosen = _as_board(found.board) | _as_before(path)
    session.forget_photographs()
    save_observations(found, session.file("observations"))
    session.settings = replace(session.settings, **chosen)
    session.kept = shown(session.folder, path)
    session.observations, session.found_with = found, session.asked()
    session.views = described(found)
    session.say(f"Corners of {len(found.used)} views from {session.kept}: choose how to solve, then calibrate.")


def _as_board(board: Board) -> dict[str, Any]:
    """The settings that describe a board; none where its kind is not installed."""
    if not isinstance(board, Checkerboard | CharucoBoard):
        return {"board_kind": board.kind, "board_spec": board.spec} if board.kind in installed().boards else {}
    described: dict[str, Any] = {
        "board_kind": board.kind,
        "grid_x": str(board.columns),
        "grid_y": str(board.rows),
        "square_mm": _in_mm(board.spacing_m),
    }
    if isinstance(board, CharucoBoard):
        described |= {"marker_mm": _in_mm(board.marker_m), "dictionary": board.dictionary}
        described |= {"inverted": board.inverted, "legacy": board.legacy}
    return described


def _in_mm(metres: float) -> str:
    return f"{1e3 * metres:.10g}"


def _as_before(path: Path) -> dict[str, Any]:
    """The settings by which a camera file was solved; none for a file of observations only."""
    try:
        before = load_calibration(path)
    except CalibError:
        return {}
    asked = before.repeated_by
    robust = asked.get("robust")
    texts = {key: str(asked[key]) for key in OF_SOLVING if asked.get(key) is not None}
    return {
        "camera_name": before.camera.name,
        "preset": "",
        "weights": "",
        **texts,
        "robust": "" if robust is None else "yes" if robust else "no",
    }
