"""A board whose shape was solved for: laid on the board as given, and the corners that its solution leaves open."""

from dataclasses import replace

import numpy as np

from opencsp_calib.arrays import Ids, Matrix, Points
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.models import LensModel
from opencsp_calib.unknowns import Estimate

__all__ = ["laid_on_given", "turn_between", "with_lone_corners"]


def turn_between(points: Points, target: Points) -> tuple[Matrix, float]:
    """The turn about the origin that brings points nearest to others, and the sum of their products after it.

    Never a mirror image, however flat the points: their third direction is weak. Source: S. Umeyama, "Least-squares
    estimation of transformation parameters between two point patterns", PAMI 1991.

    Parameters
    ----------
    points, target : (n, 3)

    Returns
    -------
    turn : (3, 3)
    product : float
        Of each turned point with its target, summed.
    """
    left, sizes, right = np.linalg.svd(target.T @ points)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(left @ right))])
    return np.asarray(left * signs @ right), float(sizes @ signs)


def laid_on_given(given: Points, estimate: Estimate, corners: Ids) -> Estimate:
    """The same estimate in the frame and scale in which its board is nearest to the board as given.

    Images tell a board's shape only up to a shift, a turn and a scale. Those seven are chosen so that the differences
    d of the corners solved for from the given ones p, about their middle, have none: ``sum d``, ``sum p x d`` and
    ``sum p . d`` are zero. These conditions and no more: others bias the rest. No projection changes.

    Parameters
    ----------
    given : (K, 3) m
    estimate : Estimate
        In any frame and unit of length.
    corners : (C,) int
        Ids of the corners solved for; the others are put where they are given.
    """
    solved, target = estimate.points[corners], given[corners]
    middle, wanted = solved.mean(axis=0), target.mean(axis=0)
    turn, product = turn_between(solved - middle, target - wanted)
    scale = ((target - wanted) ** 2).sum() / product
    points = given.copy()
    points[corners] = scale * (solved - middle) @ turn.T + wanted
    rotations = estimate.rotations @ turn.T
    translations = scale * (estimate.translations + estimate.rotations @ middle) - rotations @ wanted
    return replace(estimate, rotations=rotations, translations=translations, points=points)


def with_lone_corners(lens: LensModel, table: CornerTable, estimate: Estimate) -> Estimate:
    """The same estimate with the corners that one view alone has seen where that view has seen them.

    One view leaves their distance open: of all points that it sees in the corner's pixel, the nearest to where the
    corner is given. They agree with their pixel whatever the camera, and so tell nothing about it.

    Parameters
    ----------
    lens : LensModel
    table : CornerTable
        Of all corners.
    estimate : Estimate
        Whose board has those corners where they are given.
    """
    lone = np.bincount(table.ids, minlength=len(estimate.points))[table.ids] == 1
    view, ids = table.view[lone], table.ids[lone]
    rotations = estimate.rotations[view]
    rays = (lens.unproject(table.pixels[lone], estimate.params)[:, None, :] @ rotations)[:, 0]
    cameras = -(estimate.translations[view][:, None, :] @ rotations)[:, 0]
    points = estimate.points.copy()
    seen = cameras + rays * ((points[ids] - cameras) * rays).sum(axis=1, keepdims=True)
    points[ids] = np.where(np.isfinite(seen), seen, points[ids])  # not where the camera has no ray for the pixel
    return replace(estimate, points=points)
