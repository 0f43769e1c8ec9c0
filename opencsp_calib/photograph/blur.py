"""How a photograph is blurred, and in which direction, measured on the edges and corners of a board.

Blur spreads each point of light; S is the covariance of that spread, (2, 2) px². A straight edge with normal n gets the
width sqrt(n'Sn), so the edges of a board tell two of the three numbers in S. The third shows at the corners: where dark
and white quadrants meet, blur along the diagonal of the dark ones darkens the middle. With u and v the normals of the
two edges, the middle is ``(2 / pi) asin(u'Sv / sqrt(u'Su v'Sv))`` of the way from the mean to one of the colours, if
the spread is Gaussian (the orthant probability of two correlated Gaussians, Sheppard 1899).
"""

from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats, Mask, Matrix, Pixels
from opencsp_calib.image import Image
from opencsp_calib.photograph.sampling import bilinear

__all__ = ["Blur", "measured_blur"]

PROFILE_SAMPLES = 31
ALONG = (0.35, 0.5, 0.65)  # where an edge is crossed, as part of its length: far from the corners at its ends
CLEAR = 0.4  # of a square's height: half a profile reaches no nearer to the next edge
LARGEST_HALF_PX = 14.0
SIGMAS, FEWEST_SIGMAS = 5.0, 2.5  # half a profile, in edge widths: with less, its ends are not yet flat
FEWEST_EDGES, MOST_EDGES = 8, 64  # each way; more tell nothing new
INTERPOLATION_PX2 = 1 / 6  # what sampling between pixels adds to the variance: that of the triangle that bilinear is


@dataclass(frozen=True)
class Blur:
    """The spread of a point of light, as an ellipse of standard deviations.

    Parameters
    ----------
    major_px, minor_px : float
        Along its long and its short axis; a pixel's own area counts, so that nothing is below 0.29 px.
    direction_deg : float
        Of the long axis, from the image's x towards its y, in [0, 180).
    """

    major_px: float
    minor_px: float
    direction_deg: float

    @property
    def motion_px(self) -> float:
        """How far the image moved, evenly, while the shutter was open, if that is what makes the axes differ."""
        return float(np.sqrt(12 * max(self.major_px**2 - self.minor_px**2, 0)))


def measured_blur(image: Image, grid: Floats) -> Blur | None:
    """The blur of the photograph at a plain checkerboard.

    Parameters
    ----------
    image : Image
    grid : (rows, columns, 2) px
        The corners; NaN where there is none.

    Returns
    -------
    Blur or None
        None where there are too few edges, or they are too blurred to be told apart.
    """
    families = [_edges(image, grid, axis) for axis in (0, 1)]
    if min(len(widths) for _, widths in families) < FEWEST_EDGES:
        return None
    normals = np.concatenate([normals for normals, _ in families])
    variances = np.concatenate([widths for _, widths in families])
    sigmas = [np.sqrt(max(float(np.median(widths)), 1e-3)) for _, widths in families]
    ups, overs, middles = _middles(image, grid)
    design = np.concatenate([_products(normals, normals), _products(ups, overs)])
    target = np.concatenate([variances, sigmas[0] * sigmas[1] * np.sin(np.clip(middles, -1, 1) * (np.pi / 2))])
    xx, xy, yy = _robust_solution(design, target)
    values, axes = np.linalg.eigh(np.array([[xx, xy], [xy, yy]]) - INTERPOLATION_PX2 * np.eye(2))
    minor, major = np.sqrt(np.maximum(values, 1 / 12))
    return Blur(float(major), float(minor), float(np.degrees(np.arctan2(axes[1, 1], axes[0, 1])) % 180))


def _edges(image: Image, grid: Floats, axis: int) -> tuple[Floats, Floats]:
    """Normals (n, 2) and variances (n,) px² of the edges along the rows (axis 0) or the columns (axis 1)."""
    grid = grid if axis == 0 else np.swapaxes(grid, 0, 1)
    across = np.full_like(grid, np.nan)
    across[:-1] = grid[1:] - grid[:-1]
    across[-1] = across[-2]
    start, end, beside = grid[:, :-1], grid[:, 1:], across[:, :-1]
    # a poor detector may put two corners in one place: between them is no edge
    whole = np.isfinite(start + end + beside).all(axis=2) & (start != end).any(axis=2)
    every = len(start[whole]) // MOST_EDGES + 1
    start, way, beside = start[whole][::every], (end - start)[whole][::every], beside[whole][::every]
    length = np.linalg.norm(way, axis=1)
    normals = np.column_stack([-way[:, 1], way[:, 0]]) / length[:, None]
    clearance = CLEAR * np.abs((beside * normals).sum(axis=1))
    half = np.minimum(clearance, LARGEST_HALF_PX)
    few = slice(None, None, len(start) // FEWEST_EDGES or 1)  # as wide as there is room, to learn how wide edges are
    variances, good = _profile_variances(image, start[few], way[few], normals[few], half[few])
    if not good.any():
        return normals[:0], variances[:0]
    usual = np.sqrt(max(float(np.median(variances[good])), 0.25))
    half = np.minimum(clearance, SIGMAS * usual)
    variances, good = _profile_variances(image, start, way, normals, half)
    good &= clearance > FEWEST_SIGMAS * usual
    return normals[good], variances[good]


def _profile_variances(image: Image, start: Pixels, way: Pixels, normals: Pixels, half: Floats) -> tuple[Floats, Mask]:
    """(n,) px², the second moments of the edges' slopes, and which of them can be trusted.

    With an edge at 0 and a step from 0 to 1, the integral of t (p(t) - step(t)) is minus half the second moment: linear
    in the grey levels, so that noise leaves no bias.
    """
    t = np.linspace(-1, 1, PROFILE_SAMPLES)
    middles = start[:, None] + way[:, None] * np.array(ALONG)[:, None]
    at = middles[:, :, None] + normals[:, None, None] * (half[:, None, None] * t)[..., None]
    profile = bilinear(image, at).mean(axis=1)
    tail = PROFILE_SAMPLES // 6
    before, after = profile[:, :tail].mean(axis=1), profile[:, -tail:].mean(axis=1)
    contrast = after - before
    with np.errstate(divide="ignore", invalid="ignore"):
        excess = (profile - before[:, None]) / contrast[:, None] - np.heaviside(t, 0.5)
    step = half * (t[1] - t[0])
    shift = -excess.sum(axis=1) * step
    variances = -2 * (excess * t).sum(axis=1) * step * half - shift**2
    usual = np.nanmedian(np.abs(contrast)) if np.isfinite(contrast).any() else 0.0
    good = np.isfinite(variances) & (np.abs(contrast) > 0.4 * usual) & (np.abs(shift) < 0.5 * half)
    return np.asarray(variances), np.asarray(good)


def _middles(image: Image, grid: Floats) -> tuple[Floats, Floats, Floats]:
    """At each corner the normals (n, 2) of its edges along row and column, and the colour of its middle.

    The normals point to the next row and the next column; the colour is 1 where it is that of the quadrant between
    them, -1 where it is that of the quadrants beside.
    """
    here, next_row, next_column = grid[1:-1, 1:-1], grid[2:, 1:-1], grid[1:-1, 2:]
    around = np.stack([grid[i : i + len(grid) - 2, j : j + grid.shape[1] - 2] for i in (0, 2) for j in (0, 2)])
    squares = bilinear(image, (here + around) / 2)  # before-before, before-after, after-before, after-after
    alike, other = (squares[0] + squares[3]) / 2, (squares[1] + squares[2]) / 2
    lean = (2 * bilinear(image, here) - alike - other) / np.where(alike == other, np.nan, alike - other)
    down, on = next_row - here, next_column - here
    ups = np.stack([-on[..., 1], on[..., 0]], axis=-1)
    ups *= np.sign((ups * down).sum(axis=-1, keepdims=True))
    overs = np.stack([-down[..., 1], down[..., 0]], axis=-1)
    overs *= np.sign((overs * on).sum(axis=-1, keepdims=True))
    known = np.isfinite(lean) & np.isfinite(ups + overs).all(axis=-1) & ups.any(axis=-1) & overs.any(axis=-1)
    return _unit(ups[known]), _unit(overs[known]), lean[known]


def _unit(vectors: Pixels) -> Pixels:
    return np.asarray(vectors / np.linalg.norm(vectors, axis=-1, keepdims=True))


def _products(one: Pixels, other: Pixels) -> Matrix:
    """(n, 3) what Sxx, Sxy and Syy contribute to one'S other."""
    (x, y), (u, v) = one.T, other.T
    return np.column_stack([x * u, x * v + y * u, y * v])


def _robust_solution(design: Matrix, target: Floats) -> Floats:
    weights = np.ones(len(target))
    for _ in range(5):
        weighted = (design * weights[:, None] ** 2).T
        solution = np.linalg.lstsq(weighted @ design, weighted @ target, rcond=None)[0]
        residual = np.abs(target - design @ solution)
        weights = 1 / (1 + residual / (2 * np.median(residual) + 1e-9))
    return np.asarray(solution)
