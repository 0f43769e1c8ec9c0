"""The part of the camera file that OpenCSP passes over: what was seen, and how it was solved.

::

    /Calibration
        observations/                what went in; a file of only this is what ``detect`` writes
            image_size      (2,) i4
            board           JSON     spec, columns, rows, spacing_m; of ChArUco: marker_m, dictionary, inverted, legacy
            board_points    (K, 3) f8  m
            views           JSON     of every image looked at: image, sha256, status, problems, reason, rejected
            corners         (n,) i4  how many corners each view has; the next five are those of all views on end
            ids             (N,) i8
            pixels          (N, 2) f8
            covariance      (N, 2, 2) f8  px²; NaN where not known
            edge_width_px   (N,) f8  NaN where not known
            contrast        (N,) f8  NaN where not known
        poses               (V, 6) f8  of the used views: rotation vector (rad), translation (m), board to camera
        board_points        (K, 3) f8  m, as solved
        residuals           (M, 2) f8  px, predicted minus detected, of all used views on end
        outliers            (M,) bool
        covariance          (P, P) f8  the honest one
        covariance_residual (P, P) f8
        solver              string
        options             JSON     guess, board_shape, pixel_aspect, weights, robust
        problems            JSON
        record              JSON     of the camera: focus, aperture, temperature, free notes
        provenance          JSON     versions, time, where the images were

JSON stands for a string dataset with JSON in it. Two files are equal when everything but ``provenance`` is.
"""

import json
import os
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from opencsp_calib.arrays import Floats
from opencsp_calib.board import Board, CharucoBoard, Checkerboard, RecordedBoard
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Observations
from opencsp_calib.errors import FileFormatError, InputError
from opencsp_calib.hdf5 import read_camera, write_camera
from opencsp_calib.hdf5_reading import opened, read_dataset
from opencsp_calib.hdf5_writing import write_hdf5
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.view_json import OPTIONAL, restored_problems, restored_view, stored_problems, stored_view

if TYPE_CHECKING:
    import h5py

__all__ = ["load_calibration", "load_observations", "save_calibration", "save_observations"]

TOGETHER = 64  # views, whose corners are written at once


def save_calibration(calibration: Calibration, path: str | os.PathLike[str]) -> None:
    """Write a camera file with its calibration, aside and then in place.

    Raises
    ------
    InputError
        If the file cannot be written; what was there before stays.
    """

    def fill(file: "h5py.File") -> None:
        write_camera(calibration.camera, file)
        group = file.create_group("Calibration")
        _write_observations(calibration.observations, group.create_group("observations"))
        group["poses"] = np.array([[*p.rotation, *p.translation] for p in calibration.cam_from_board]).reshape(-1, 6)
        group["board_points"] = calibration.board.points
        _write_on_end(group, "residuals", calibration.residuals, (2,))
        _write_on_end(group, "outliers", calibration.outliers, (), dtype=np.bool_)
        group["covariance"] = calibration.covariance
        group["covariance_residual"] = calibration.covariance_residual
        group["solver"] = calibration.solver
        group["options"] = json.dumps(_options_as_json(calibration.options))
        group["problems"] = json.dumps(stored_problems(calibration.problems))
        group["record"] = json.dumps(dict(calibration.record))
        group["provenance"] = json.dumps(dict(calibration.provenance))

    write_hdf5(path, fill)


def load_calibration(path: str | os.PathLike[str]) -> Calibration:
    """The calibration in a camera file.

    Raises
    ------
    FileFormatError
        If the file is damaged, or has no calibration in it (OpenCSP's own files have none).
    """
    camera, _ = read_camera(path)
    with opened(path) as file:
        if "Calibration" not in file or "poses" not in file["Calibration"]:
            raise FileFormatError(f"{path} has a camera, but not how it was calibrated")
        group = file["Calibration"]
        observations = _read_observations(group["observations"])
        ends = np.cumsum([len(d) for d in observations.detections])[:-1]
        return Calibration(
            camera=camera,
            observations=observations,
            cam_from_board=tuple(Pose(row[:3], row[3:]) for row in _array(group, "poses", (None, 6))),
            board=observations.board.with_points(read_dataset(group, "board_points")),
            solver=str(read_dataset(group, "solver")),
            options=_options_from_json(_json(group, "options")),
            residuals=tuple(np.split(_array(group, "residuals", (None, 2)), ends)),
            outliers=tuple(np.split(_array(group, "outliers", (None,)).astype(bool), ends)),
            covariance=read_dataset(group, "covariance"),
            covariance_residual=read_dataset(group, "covariance_residual"),
            problems=restored_problems(_json(group, "problems")),
            record={str(key): str(value) for key, value in _json(group, "record").items()},
            provenance=_json(group, "provenance"),
        )


def save_observations(observations: Observations, path: str | os.PathLike[str]) -> None:
    """Write what was detected, without a camera, aside and then in place."""
    write_hdf5(path, lambda file: _write_observations(observations, file.create_group("Calibration/observations")))


def load_observations(path: str | os.PathLike[str]) -> Observations:
    """The observations in a camera file or in a file that ``detect`` wrote.

    Raises
    ------
    FileFormatError
        If the file is damaged, or has no observations in it.
    """
    with opened(path) as file:
        if "Calibration/observations" not in file:
            raise FileFormatError(f"{path} has no observations in it, so that it cannot be solved again")
        return _read_observations(file["Calibration/observations"])


def _write_observations(observations: Observations, group: "h5py.Group") -> None:
    board, views = observations.board, observations.views
    group["image_size"] = np.array(observations.image_size, dtype=np.int32)
    group["board"] = json.dumps(
        {"spec": board.spec, "columns": board.columns, "rows": board.rows, "spacing_m": board.spacing_m}
        | _charuco_fields(board)
    )
    group["board_points"] = board.points
    group["views"] = json.dumps([stored_view(view) for view in views])
    group["corners"] = np.array([len(view.detection) for view in views], dtype=np.int32)
    _write_on_end(group, "ids", [view.detection.ids for view in views], (), dtype=np.int64)
    _write_on_end(group, "pixels", [view.detection.pixels for view in views], (2,))
    for name, shape in OPTIONAL.items():
        known = [_or_nan(getattr(view.detection, name), (len(view.detection), *shape)) for view in views]
        _write_on_end(group, name, known, shape)


def _write_on_end(
    group: "h5py.Group", name: str, arrays: Sequence[Any], shape: tuple[int, ...], dtype: type = np.float64
) -> None:
    """Write what is known of each view's corners, (n, ...), as one dataset; but never make one array of all."""
    dataset = group.create_dataset(name, (sum(map(len, arrays)), *shape), dtype)
    end = 0
    for first in range(0, len(arrays), TOGETHER):
        part = np.concatenate(arrays[first : first + TOGETHER])
        begin, end = end, end + len(part)
        dataset[begin:end] = part


def _read_observations(group: "h5py.Group") -> Observations:
    counts = _array(group, "corners", (None,)).astype(np.int64)
    if (counts < 0).any():
        raise FileFormatError(f"{group.file.filename}: a view has a negative number of corners")
    ends = np.cumsum(counts)[:-1]
    names = ("ids", "pixels", *OPTIONAL)
    columns = {name: np.split(np.asarray(read_dataset(group, name)), ends) for name in names}
    known = {name: [None if np.isnan(values).all() else values for values in columns[name]] for name in OPTIONAL}
    arrays: dict[str, list[Any]] = {**columns, **known}
    described = _json(group, "views")
    if len(described) != len(counts):
        raise FileFormatError(f"{group.file.filename}: {len(described)} views, but corners of {len(counts)}")
    views = []
    for index, entry in enumerate(described):
        try:
            views.append(restored_view(entry, {name: arrays[name][index] for name in names}))
        except InputError as error:  # NaN, a corner twice
            raise FileFormatError(f"{group.file.filename}: view {index + 1} of {len(described)}: {error}") from None
    width, height = (int(side) for side in read_dataset(group, "image_size"))
    points = _array(group, "board_points", (None, 3))
    try:
        return Observations(_board_from_json(_json(group, "board"), points), (width, height), tuple(views))
    except InputError as error:  # NaN again, or a corner that the board has not
        raise FileFormatError(f"{group.file.filename}: {error}") from None


def _charuco_fields(board: Board) -> dict[str, Any]:
    if not isinstance(board, CharucoBoard):
        return {}
    names = ("marker_m", "dictionary", "inverted", "legacy")
    return {name: getattr(board, name) for name in names}


def _board_from_json(entry: Mapping[str, Any], points: Floats) -> Board:
    """Of its own class where the core knows the kind; of any other kind, what is needed to solve with it."""
    fields = {name: value for name, value in entry.items() if name != "spec"}
    kind = str(entry["spec"]).partition(":")[0]
    if kind == Checkerboard.kind:
        return Checkerboard(**fields, points=points)
    if kind == CharucoBoard.kind:
        return CharucoBoard(**fields, points=points)
    return RecordedBoard(**fields, recorded_spec=str(entry["spec"]), points=points)


def _options_as_json(options: SolveOptions) -> dict[str, Any]:
    guess = options.guess
    return {
        "guess": guess and [guess.name, guess.model, guess.params.tolist(), list(guess.image_size)],
        "board_shape": options.board_shape,
        "pixel_aspect": options.pixel_aspect,
        "weights": options.weights,
        "robust": options.robust,
    }


def _options_from_json(entry: Mapping[str, Any]) -> SolveOptions:
    guess = entry["guess"]
    camera = guess and Camera(str(guess[0]), str(guess[1]), guess[2], (guess[3][0], guess[3][1]))
    return SolveOptions(camera, entry["board_shape"], entry["pixel_aspect"], entry["weights"], bool(entry["robust"]))


def _json(group: "h5py.Group", name: str) -> Any:
    try:
        return json.loads(str(read_dataset(group, name)))
    except (json.JSONDecodeError, RecursionError) as error:
        raise FileFormatError(f"{group.file.filename}: {group.name}/{name} is not JSON: {error}") from None


def _array(group: "h5py.Group", name: str, shape: tuple[int | None, ...]) -> Floats:
    value = np.asarray(read_dataset(group, name))
    if value.ndim != len(shape) or any(want not in (None, have) for want, have in zip(shape, value.shape, strict=True)):
        raise FileFormatError(f"{group.file.filename}: {group.name}/{name} has the unexpected shape {value.shape}")
    return value.astype(np.float64)


def _or_nan(values: Floats | None, shape: tuple[int, ...]) -> Floats:
    return np.full(shape, np.nan) if values is None else values
