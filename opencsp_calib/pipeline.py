"""From photographs to a calibration: the only place where the parts are put together."""

import os
from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np

from opencsp_calib import board_shape as shapes
from opencsp_calib import hdf5_reading, selecting
from opencsp_calib.asking import DEFAULT_MODEL, DEFAULT_SOLVER, asked, check_solving
from opencsp_calib.blas import blas_on_one_thread
from opencsp_calib.board import Board
from opencsp_calib.board_file import read_board_file
from opencsp_calib.calibration import LEAST_VIEWS, Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.cluster import Scheduler
from opencsp_calib.counted import counted
from opencsp_calib.detecting import Progress, Stop, check_board_seen, look_at
from opencsp_calib.detection import Observations
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.hdf5_calibration import load_calibration
from opencsp_calib.images import find_images
from opencsp_calib.interfaces import Detector
from opencsp_calib.journal import Journal
from opencsp_calib.looking import Refine, Search
from opencsp_calib.options import BoardShape, PixelAspect, SolveOptions, Weights
from opencsp_calib.provenance import made_with
from opencsp_calib.registry import installed
from opencsp_calib.selecting import Selection
from opencsp_calib.uncertainty import with_uncertainty

__all__ = [
    "DEFAULT_MODEL",
    "DEFAULT_SOLVER",
    "PixelAspect",
    "board_from",
    "calibrate",
    "check_solving",
    "detect",
    "places_of",
    "select",
    "solve",
]

OF_DETECT = ("detector", "refine", "jobs", "progress", "stop", "journal", "scheduler")

Images: TypeAlias = str | os.PathLike[str] | Iterable[str | os.PathLike[str]]


def board_from(text: str) -> Board:
    """The board that a one-line description, a board file (.json), or a camera file (.h5, its board as solved) names.

    Raises
    ------
    InputError
        If it is none of them; the message shows how a description is written.
    """
    path = Path(text)
    if path.suffix.lower() == ".json":
        return read_board_file(path, installed().board)
    if path.suffix.lower() in hdf5_reading.EXTENSIONS:
        return load_calibration(path).board
    return installed().board(text)


def detect(
    images: Images,
    board: Board,
    *,
    detector: str | Detector | None = None,
    refine: Refine | None = None,
    jobs: int | None = None,
    progress: Progress | None = None,
    stop: Stop | None = None,
    journal: Journal | None = None,
    scheduler: "Scheduler | None" = None,
) -> Observations:
    """Find a board in photographs.

    Parameters
    ----------
    images : path, or several
        Files, folders or glob patterns.
    board : Board
    detector : str or Detector, optional
        Its name, or one that is not installed itself; by default the one for this kind of board.
    refine : 'none', 'subpix' or 'model', optional
        How corners are located once found: as the detector gives them, by OpenCV's sub-pixel search, or by fitting
        the image of a corner. By default 'model' for corners of a checkerboard.
    jobs : int, optional
        Images looked at at the same time; by default one a core.
    progress : callable, optional
        Called with the number of images done, their total, and the last view.
    stop : threading.Event, optional
        Set it to stop.
    journal : Journal, optional
        Where what is found is kept as it comes, and taken from if an earlier run was interrupted.
    scheduler : str or distributed.Client, optional
        A Dask cluster whose workers do the work: an address such as ``tcp://10.0.0.5:8786``, or a client. Dask's
        messages are pickles, so that it must be one to be trusted.

    Returns
    -------
    Observations
        Of all images, with what became of each; one bad image does not stop the others.

    Raises
    ------
    InputError
        If there are no images, none can be read, or the detector cannot run.
    CancelledError
        If it was stopped.
    """
    registry = installed()
    files = find_images(images)
    finder = registry.detector(detector) if isinstance(detector, str) else detector or registry.detector_for(board)
    if not finder.supports(board):
        able = sorted(name for name, one in registry.detectors.items() if one.supports(board))
        raise InputError(f"the detector {finder.name!r} cannot look for a {board.kind}; able are: {', '.join(able)}")
    search = Search(board, finder, refine or ("model" if finder.feature == "corner" else "none"))
    return look_at(files, search, jobs, progress, stop, journal, scheduler)


def solve(
    observations: Observations,
    model: str = DEFAULT_MODEL,
    solver: str = DEFAULT_SOLVER,
    *,
    board_shape: BoardShape | Literal["auto"] = "auto",
    pixel_aspect: PixelAspect | None = None,
    weights: Weights | None = None,
    robust: bool | None = None,
    guess: Camera | None = None,
    name: str = "camera",
    record: Mapping[str, str] | None = None,
    provenance: Mapping[str, Any] | None = None,
) -> Calibration:
    """Solve for the camera, with honest uncertainty.

    Parameters
    ----------
    observations : Observations
    model : str
        The lens model.
    solver : str
    board_shape : 'auto', 'flat', 'warp' or 'free'
        Whether the board is taken as it is given, gets a smooth warp, or has every corner's position solved for;
        'auto' decides from the data and says so, where the solver is able to solve for the shape.
    pixel_aspect : 'free', 'square' or float, optional
        Whether fx and fy are independent, equal, or in the ratio fy/fx. By default free, but square where the board's
        shape is solved for and all views hold it the same way up, because then the two cannot be told apart.
    weights : 'equal' or 'covariance', optional
    robust : bool, optional
        These two by default by covariance and robust with `DEFAULT_SOLVER`, which can do both with any corners and any
        board; with others equal and not robust.
    guess : Camera, optional
        Where to start.
    name : str
        Of the camera.
    record, provenance : mapping, optional
        To be kept with the calibration.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If there are too few views, or the solver is not able to do what is asked.
    CalibrationFailedError
        If no result can be trusted.
    """
    engine, options = asked(model, solver, board_shape, pixel_aspect, weights, robust, guess)
    _check_views(observations)

    def run(views: Observations, chosen: SolveOptions) -> Calibration:
        return engine.solve(views, model, chosen)

    decides = board_shape == "auto" and "board_free" in engine.abilities
    solving = shapes.decide if decides else shapes.solve_with_aspect
    as_it_is = pixel_aspect is not None or "pixel_aspect" not in engine.abilities
    try:
        with blas_on_one_thread():
            solved = with_uncertainty(solving(observations, options, run, aspect_given=as_it_is))
    except CalibrationFailedError as error:
        if guess is None:
            raise
        raise CalibrationFailedError(f"{error}; it may also be the guess: try without it") from error
    return replace(
        solved,
        camera=replace(solved.camera, name=name),
        record=record or {},
        provenance={
            **made_with(),
            "asked": {
                "model": model,
                "solver": solver,
                "board_shape": board_shape,
                "pixel_aspect": pixel_aspect,
                "weights": weights,
                "robust": robust,
            },
            **(provenance or {}),
        },
    )


def select(
    observations: Observations, count: int, *, progress: Callable[[int, int], None] | None = None, **options: Any
) -> Selection:
    """The views that together tell most about the camera, to be solved by these `options` of `solve`.

    Parameters
    ----------
    observations : Observations
    count : int
        How many.
    progress : callable, optional
        Called with the number of views judged, and their total.

    Raises
    ------
    InputError
        If `count` is too small.
    CalibrationFailedError
        If no first camera comes out of a few views.
    """

    def rough(few: Observations) -> Calibration:
        return solve(few, **{**options, "board_shape": "flat"})

    known = options.get("board_shape") == "flat"
    return selecting.select(observations, count, rough, board_shape_known=known, progress=progress)


def calibrate(
    images: Images, board: Board, model: str = DEFAULT_MODEL, solver: str = DEFAULT_SOLVER, **options: Any
) -> Calibration:
    """Photographs to a calibration: `detect`, then `solve`, whose options it takes by name; and ``select=N``."""
    of_detect = {key: options.pop(key) for key in OF_DETECT if key in options}
    options.setdefault("provenance", places_of(images))
    count = options.pop("select", None)
    check_solving(model, solver, **options)
    observations = detect(images, board, **of_detect)
    if count:
        observations = select(observations, count, model=model, solver=solver, **options).observations
    return solve(observations, model, solver, **options)


def places_of(images: Images) -> dict[str, Any]:
    """Where images are, to be kept as provenance: a report shows them again from there."""
    return {"images": {file.name: str(file.path.absolute()) for file in find_images(images)}}


def _check_views(observations: Observations) -> None:
    check_board_seen(observations)
    used, looked_at = len(observations.used), len(observations.views)
    if used < LEAST_VIEWS:
        raise InputError(
            f"only {used} of {counted(looked_at, 'image')} can be used; a calibration needs at least {LEAST_VIEWS} "
            "views, better about 50"
        )
    # the same pose again adds no information: a solver would fail, or worse, not fail
    if all(np.array_equal(d.pixels, observations.detections[0].pixels) for d in observations.detections[1:]):
        raise InputError("all views show the board in the very same place; take views from different directions")
