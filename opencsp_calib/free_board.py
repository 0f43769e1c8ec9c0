"""A board whose shape was solved for: laid on the board as given, and the corners that its solution leaves open."""

from collections.abc import Sequence

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Mask, Params, Points
from opencsp_calib.board import Board
from opencsp_calib.detection import Detection
from opencsp_calib.models import LensModel
from opencsp_calib.rotations import rotation_matrices, rotation_vectors

__all__ = ["laid_on_given", "times_seen", "with_lone_corners"]


def times_seen(board: Board, detections: Sequence[Detection]) -> Ids:
    """(K,) in how many views each corner is: from one alone, its distance cannot be told."""
    ids = np.concatenate([detection.ids for detection in detections])
    return np.asarray(np.bincount(ids, minlength=len(board.points)))


def laid_on_given(
    board: Board, points: Points, rotations: Floats, translations: Floats, solved: Mask
) -> tuple[Points, Floats, Floats]:
    """A board as solved, turned, shifted and scaled to the board as given, with poses that show the same.

    Images tell a board's shape up to a similarity: it is chosen so that the corners solved for lie nearest to the
    given ones, in the sense of least squares (Umeyama 1991). These seven conditions and no more: others bias the rest.

    Parameters
    ----------
    board : Board
        As given.
    points : (K, 3)
        As solved, in any frame and unit of length.
    rotations : (V, 3) rad
        Rotation vectors, of that frame to the camera.
    translations : (V, 3)
        In that unit.
    solved : (K,) bool
        Which points count.

    Returns
    -------
    points : (K, 3) m
    rotations : (V, 3) rad
    translations : (V, 3) m
    """
    wanted, found = board.points[solved].mean(axis=0), points[solved].mean(axis=0)
    left, sizes, right = np.linalg.svd((board.points[solved] - wanted).T @ (points[solved] - found))
    # never a mirror image, however flat the board: its third direction is weak
    sign = np.array([1.0, 1.0, np.linalg.det(left @ right)])
    turn = (left * sign) @ right
    scale = float((sizes * sign).sum() / ((points[solved] - found) ** 2).sum())
    laid = scale * (points - found) @ turn.T + wanted
    before = rotation_matrices(rotations)
    after = before @ turn.T
    return laid, rotation_vectors(after), scale * (translations + before @ found) - after @ wanted


def with_lone_corners(
    lens: LensModel,
    params: Params,
    detections: Sequence[Detection],
    points: Points,
    rotations: Floats,
    translations: Floats,
    lone: Mask,
) -> Points:
    """The same board with the corners that one view alone has seen where that view has seen them.

    One view leaves their distance open: of all points that it sees in the corner's pixel, the nearest to where the
    corner is given. They agree with their pixel whatever the camera, and so tell nothing about it.

    Parameters
    ----------
    lens, params
        Of the camera as solved.
    detections : one per used view
    points : (K, 3) m
        As solved; lone ones as given.
    rotations : (V, 3) rad
    translations : (V, 3) m
    lone : (K,) bool
    """
    placed: Points = points.copy()
    for detection, rotation, translation in zip(detections, rotations, translations, strict=True):
        here = lone[detection.ids]
        ids, turn = detection.ids[here], rotation_matrices(rotation)
        rays, camera = lens.unproject(detection.pixels[here], params) @ turn, -translation @ turn
        placed[ids] = camera + rays * ((points[ids] - camera) * rays).sum(axis=1, keepdims=True)
    return placed
