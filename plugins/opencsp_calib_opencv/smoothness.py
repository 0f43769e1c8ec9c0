"""Is a grid of corners the image of a flat board? Then its pixels are smooth functions of row and column."""

import numpy as np

from opencsp_calib.arrays import Floats, Mask, Matrix
from opencsp_calib_opencv.grid import known, square_height

__all__ = ["smooth_part"]

MOST_MISFIT_PX = 0.5  # saddles are good to that where a photograph is noisy, and
MOST_MISFIT = 0.04  # of the squares' height, for boards that are bent and lenses that are strange
FEWEST_CORNERS = 6
ORDERS = ((150, 7), (80, 5), (24, 3))  # fewest corners for an order of polynomial


def smooth_part(grid: Floats) -> Floats:
    """The grid without the corners that a homography, if need be bent by a polynomial of low order, does not explain.

    Which corners those are is found by leaving out the worst until the others agree; too few to tell are kept.
    """
    there = known(grid)
    if there.sum() < FEWEST_CORNERS:
        return grid
    while there.sum() >= FEWEST_CORNERS:
        grid = np.where(there[..., None], grid, np.nan)
        allowed = MOST_MISFIT * square_height(grid)[there] + MOST_MISFIT_PX
        misfit = np.nan_to_num(_misfit(grid, there, allowed) / allowed, nan=np.inf)
        worst = misfit.max()
        if worst <= 1:
            return grid
        there[there] = misfit < max(1, 0.6 * worst)
    return np.full_like(grid, np.nan)


def _misfit(grid: Floats, there: Mask, allowed: Floats) -> Floats:
    """(k,) px, of the corners that are there; of the homography alone where that is all that is allowed."""
    import cv2

    row, column = np.nonzero(there)
    rows, columns = there.shape
    across = np.column_stack([column / max(columns - 1, 1), row / max(rows - 1, 1)]) * 2 - 1
    pixels = grid[there]
    homography, _ = cv2.findHomography(across, pixels, 0)
    if homography is None:
        return np.full(len(pixels), np.inf)
    left = pixels - cv2.perspectiveTransform(across[None], homography)[0]
    order = next((order for fewest, order in ORDERS if len(pixels) >= fewest), None)
    misfit = np.linalg.norm(left, axis=1)
    if order and not (misfit <= allowed).all():
        terms = _products(across, order)
        misfit = np.linalg.norm(left - terms @ np.linalg.lstsq(terms, left, rcond=None)[0], axis=1)
    return np.asarray(misfit)


def _products(across: Matrix, order: int) -> Matrix:
    """(n, p) all products of x and y up to the order."""
    x, y = across.T
    return np.column_stack([x**i * y**j for i in range(order + 1) for j in range(order + 1 - i)])
