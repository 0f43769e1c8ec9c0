"""The result: a camera, and everything that says how far to trust it."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, TypeAlias

import numpy as np

from opencsp_calib.arrays import Floats, Mask, Matrix, Params, frozen, frozen_mask
from opencsp_calib.board import Board
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Observations, Problem
from opencsp_calib.errors import InputError
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.rotations import rotation_matrices

__all__ = ["LEAST_VIEWS", "Calibration", "Solve"]

ASKED = ("model", "solver", "board_shape", "pixel_aspect", "weights", "robust")
LEAST_VIEWS = 3
"""Below these nobody calibrates: two views may do in theory, and nothing tells how wrong they are."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A camera as solved from observations.

    Parameters
    ----------
    camera : Camera
    observations : Observations
        What went in.
    cam_from_board : tuple of Pose
        One per used view, in order.
    board : Board
        As solved: the one of the observations where its shape was held.
    solver : str
        Name and version, such as ``opencv 5.0.0``.
    options : SolveOptions
        What was asked for.
    residuals : tuple of (n, 2) px
        Predicted minus detected, one array per used view; by default computed.
    outliers : tuple of (n,) bool
        The corners of each used view that were left out as outliers; by default none.
    covariance : (P, P)
        Of the camera's parameters: the honest one, poses and board marginalised. NaN where not known (yet).
    covariance_residual : (P, P)
        As the residuals alone would have it, taking them as independent. NaN where not known (yet).
    problems : tuple of Problem
        What a person should know about how it was solved.
    record : mapping of str to str
        Of the camera: focus, aperture, temperature, working range, free notes.
    provenance : mapping of str to JSON-like values
        Versions, time, where the images were.
    """

    camera: Camera
    observations: Observations
    cam_from_board: tuple[Pose, ...] = field(repr=False)
    board: Board
    solver: str
    options: SolveOptions
    residuals: tuple[Floats, ...] = field(default=None, repr=False)  # type: ignore[arg-type]  # filled below
    outliers: tuple[Mask, ...] = field(default=None, repr=False)  # type: ignore[arg-type]  # filled below
    covariance: Matrix = field(default=None, repr=False)  # type: ignore[arg-type]  # filled below
    covariance_residual: Matrix = field(default=None, repr=False)  # type: ignore[arg-type]  # filled below
    problems: tuple[Problem, ...] = ()
    record: Mapping[str, str] = field(default_factory=dict)
    provenance: Mapping[str, Any] = field(default_factory=dict, repr=False)

    def __post_init__(self) -> None:
        detections = self.observations.detections
        if len(self.cam_from_board) != len(detections):
            raise InputError(f"{len(self.cam_from_board)} poses do not fit {len(detections)} used views")
        if self.outliers is None:
            object.__setattr__(self, "outliers", tuple(np.zeros(len(d), dtype=bool) for d in detections))
        residuals = self._computed_residuals() if self.residuals is None else self.residuals
        pairs = zip(residuals, self.outliers, detections, strict=True)
        frozen_pairs = [
            (frozen(r, "residuals", (len(d), 2), finite=False), frozen_mask(o, "outliers", (len(d),)))
            for r, o, d in pairs
        ]
        object.__setattr__(self, "residuals", tuple(r for r, _ in frozen_pairs))
        object.__setattr__(self, "outliers", tuple(o for _, o in frozen_pairs))
        size = len(self.camera.params)
        for name in ("covariance", "covariance_residual"):
            value = getattr(self, name)
            value = np.full((size, size), np.nan) if value is None else value
            object.__setattr__(self, name, frozen(value, name, (size, size), finite=False))
        object.__setattr__(self, "record", MappingProxyType(dict(self.record)))
        object.__setattr__(self, "provenance", MappingProxyType(dict(self.provenance)))

    @property
    def rms_px(self) -> float:
        """Root mean square length of the residuals, over every corner that is not an outlier."""
        squares = sum(float((r[~o] ** 2).sum()) for r, o in zip(self.residuals, self.outliers, strict=True))
        corners = sum(map(len, self.outliers)) - self.rejected_corners
        return float(np.sqrt(squares / corners)) if corners else float("nan")

    @property
    def view_rms_px(self) -> Floats:
        """(V,) the same for each used view; NaN where all its corners are outliers."""
        return np.array([_rms(r[~o]) for r, o in zip(self.residuals, self.outliers, strict=True)])

    @property
    def rejected_corners(self) -> int:
        """How many corners of the used views were left out as outliers."""
        return int(sum(o.sum() for o in self.outliers))

    @property
    def sigma(self) -> Params:
        """(P,) standard deviations of the parameters, the honest ones."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def repeated_by(self) -> dict[str, Any]:
        """The options of `pipeline.solve` that repeat it, as far as it tells them; at least model and solver."""
        told = self.provenance.get("asked")
        if not isinstance(told, Mapping):
            return {"model": self.camera.model, "solver": self.solver.partition(" ")[0]}
        known = {name: told[name] for name in ASKED if name in told}  # it may come from anybody's file
        return {name: value for name, value in known.items() if isinstance(value, str | bool | int | float | None)}

    def with_problems(self, *problems: Problem) -> "Calibration":
        """The same result with more to say."""
        return replace(self, problems=self.problems + problems)

    def _computed_residuals(self) -> Iterator[Floats]:
        turns = rotation_matrices(np.array([pose.rotation for pose in self.cam_from_board]).reshape(-1, 3))
        for turn, pose, d in zip(turns, self.cam_from_board, self.observations.detections, strict=True):
            yield self.camera.project(self.board.points[d.ids] @ turn.T + pose.translation) - d.pixels


Solve: TypeAlias = Callable[[Observations], Calibration]


def _rms(residuals: Floats) -> float:
    return float(np.sqrt((residuals**2).sum(axis=1).mean())) if len(residuals) else float("nan")
