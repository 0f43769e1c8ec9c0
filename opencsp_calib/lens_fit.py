"""Fitting one of our lens models to any other projection, over the image, with the error that is left.

What the pixels of an image see is found by inverting the other projection numerically; our model is then fitted to
those rays and pixels in the same camera frame (a turn of the frame is not fitted: it would hide errors). The rays
are spread evenly over the image, so that rms and worst error are those of its pixels.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from opencsp_calib.arrays import Floats, Params, Pixels, Points
from opencsp_calib.camera import Camera
from opencsp_calib.errors import InputError
from opencsp_calib.models import LENS_MODELS, LensModel, lens_model

__all__ = ["LensFit", "fit", "seen"]

NODES = 2500  # about how many pixels of the image are compared
LADDER = ("pinhole", "opencv4", "opencv5", "opencv8", "opencv12", "opencv14")
"""Each step starts from the one before: rational models started from nothing end in false minima."""

FOLDED_PX = 1e6  # stands for the error of a ray beyond a fold, so that a step there is taken back
STEP = 1e-6  # for numerical derivatives of a stranger's projection, radians
GRAZING = 1e-3  # z of the flattest ray that a model on the plane is asked to carry


@dataclass(frozen=True)
class LensFit:
    """A camera fitted to another projection, and how far it is off.

    Parameters
    ----------
    camera : Camera
    rms_px, worst_px : float
        Length of the difference in pixels, over the part of the image that sees anything.
    coverage : float
        The share of the image that sees anything: below 1 for a fisheye whose image circle is within the frame.
    """

    camera: Camera
    rms_px: float
    worst_px: float
    coverage: float

    def __str__(self) -> str:
        share = np.floor(1000.0 * self.coverage) / 10.0  # 100 only where it is all of it
        return f"rms {self.rms_px:.3g} px, worst {self.worst_px:.3g} px over {share:g} % of the image"


def fit(
    project: Callable[[Points], Pixels],
    image_size: tuple[int, int],
    model: str,
    guess: Params | None = None,
    *,
    name: str = "",
    max_angle: float = np.pi,
) -> LensFit:
    """Fit a lens model to a projection, over the image.

    Parameters
    ----------
    project : callable
        (N, 3) points in the camera's frame to (N, 2) pixels, NaN where there is no image.
    image_size : (int, int)
        Width and height.
    model : str
        The lens model's name.
    guess : (P,), optional
        Where to start.
    name : str
        The camera's.
    max_angle : float
        Leave out what is farther off the axis, radians: a fisheye's black corners, where models only extrapolate.

    Returns
    -------
    LensFit

    Raises
    ------
    InputError
        If the projection shows nothing in the image, or more than the model can: beside or behind the camera.
    """
    lens = lens_model(model)
    rays, pixels, coverage = seen(_within(project, max_angle), image_size)
    flattest = float(rays[:, 2].min())
    if model in LADDER and flattest < GRAZING:
        angle = np.degrees(np.arccos(flattest))
        raise InputError(
            f"{model} cannot show what is {angle:.0f} degrees off the axis, as the image does; fit opencv_fisheye"
        )
    params = _climbed(lens, rays, pixels) if guess is None else _adjusted(lens, rays, pixels, guess)
    errors = np.linalg.norm(lens.project(rays, params) - pixels, axis=1)
    rms, worst = float(np.sqrt((errors**2).mean())), float(errors.max())
    return LensFit(Camera(name, model, params, image_size), rms, worst, coverage)


def seen(project: Callable[[Points], Pixels], image_size: tuple[int, int]) -> tuple[Points, Pixels, float]:
    """What an image sees, as rays spread evenly over it, from edge to edge.

    Parameters
    ----------
    project : callable
        As for `fit`.
    image_size : (int, int)

    Returns
    -------
    rays : (N, 3)
        Unit vectors.
    pixels : (N, 2) px
        Exactly where they are projected.
    coverage : float
        The share of the image that sees anything.

    Raises
    ------
    InputError
        If that is nothing, or next to nothing.
    """
    nodes, spacing = _nodes(image_size)
    rays = _nearest_of_fan(project, nodes)
    for _ in range(20):
        rays, moved = _newton_step(project, rays, nodes)
        if not moved > 1e-9:
            break
    pixels = project(rays)
    near = np.linalg.norm(pixels - nodes, axis=1) < 0.05 * spacing  # False for NaN
    if np.count_nonzero(near) < 50:
        raise InputError("the projection shows (next to) nothing within the image: focal length, centre and size clash")
    return rays[near], pixels[near], float(near.mean())


def _within(project: Callable[[Points], Pixels], max_angle: float) -> Callable[[Points], Pixels]:
    def limited(points: Points) -> Pixels:
        angle = np.arctan2(np.hypot(points[:, 0], points[:, 1]), points[:, 2])
        return np.where((angle <= max_angle)[:, None], project(points), np.nan)

    return limited if max_angle < np.pi else project


def _nodes(image_size: tuple[int, int]) -> tuple[Pixels, float]:
    """Pixels evenly over the image, outer edges included, and their spacing."""
    width, height = image_size
    spacing = max(1e-3, np.sqrt(width * height / NODES))
    columns, rows = (int(np.clip(np.ceil(side / spacing), 2, NODES)) + 1 for side in image_size)
    x, y = np.meshgrid(np.linspace(-0.5, width - 0.5, columns), np.linspace(-0.5, height - 0.5, rows))
    return np.column_stack([x.ravel(), y.ravel()]), float(spacing)


def _nearest_of_fan(project: Callable[[Points], Pixels], nodes: Pixels) -> Points:
    """For each node the ray, of a fan around the axis, whose image is nearest.

    Along each direction the fan ends where the image stops moving outwards: from there on the projection folds.
    """
    from scipy.spatial import cKDTree

    theta = np.concatenate([[1e-5], np.geomspace(1e-4, 3.1, 220)])
    phi = np.linspace(0.0, 2 * np.pi, 72, endpoint=False)
    sine = np.sin(theta)[None, :, None]
    around = np.stack([np.cos(phi), np.sin(phi), np.zeros_like(phi)], axis=1)[:, None, :]
    fan = around * sine + np.array([0.0, 0.0, 1.0]) * np.cos(theta)[None, :, None]
    pixels = project(fan.reshape(-1, 3)).reshape(len(phi), len(theta), 2)
    radius = np.linalg.norm(pixels - pixels[:, :1], axis=2)
    outwards = np.diff(radius, axis=1, prepend=-1.0) > 0
    alive = np.logical_and.accumulate(outwards | ~np.isfinite(radius), axis=1) & np.isfinite(radius)
    if not alive.any():
        raise InputError("the projection shows nothing: no ray has an image")
    _, nearest = cKDTree(pixels[alive]).query(nodes)
    return np.asarray(fan[alive][nearest], dtype=np.float64)


def _newton_step(project: Callable[[Points], Pixels], rays: Points, nodes: Pixels) -> tuple[Points, float]:
    """Rays whose images are nearer to the nodes, and how far the farthest was moved (radians)."""
    first = np.cross(rays, np.where(np.abs(rays[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]]))
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(rays, first)
    error = nodes - project(rays)
    by_first = (project(rays + STEP * first) - project(rays - STEP * first)) / (2 * STEP)
    by_second = (project(rays + STEP * second) - project(rays - STEP * second)) / (2 * STEP)
    with np.errstate(all="ignore"):
        determinant = by_first[:, 0] * by_second[:, 1] - by_first[:, 1] * by_second[:, 0]
        a = (error[:, 0] * by_second[:, 1] - error[:, 1] * by_second[:, 0]) / determinant
        b = (by_first[:, 0] * error[:, 1] - by_first[:, 1] * error[:, 0]) / determinant
        length = np.hypot(a, b)
        shorter = np.minimum(1.0, 0.1 / length)
    step = np.nan_to_num(a * shorter)[:, None] * first + np.nan_to_num(b * shorter)[:, None] * second
    moved = rays + step
    moved /= np.linalg.norm(moved, axis=1, keepdims=True)
    lost = ~np.isfinite(project(moved)).all(axis=1)
    moved[lost] = rays[lost]
    return moved, float(np.nanmax(length, initial=0.0, where=~lost))


def _climbed(lens: LensModel, rays: Points, pixels: Pixels) -> Params:
    """The best parameters, reached over the lesser models of the same kind, all of them or only the polynomial ones.

    Neither way is always the better: a rational model without a tilt may run off to a false minimum, and so may one
    that starts with all of its terms at nothing.
    """
    start = _without_distortion(lens, rays, pixels)
    if lens.name not in LADDER:
        return _adjusted(lens, rays, pixels, start)
    steps = LADDER[: LADDER.index(lens.name) + 1]
    ways = {steps, (*steps[:3], lens.name) if len(steps) > 3 else steps}
    found = [_along(way, rays, pixels, start) for way in sorted(ways)]
    return min(found, key=lambda params: float(((lens.project(rays, params) - pixels) ** 2).sum()))


def _along(way: tuple[str, ...], rays: Points, pixels: Pixels, params: Params) -> Params:
    for step in way:
        lesser = LENS_MODELS[step]
        missing = len(lesser.parameter_names) - len(params)
        params = _adjusted(lesser, rays, pixels, np.concatenate([params, np.zeros(missing)]))
    return params


def _without_distortion(lens: LensModel, rays: Points, pixels: Pixels) -> Params:
    """Focal lengths and centre that fit best with no distortion at all: a linear problem."""
    bare = np.zeros(len(lens.parameter_names))
    bare[:2] = 1.0
    plane = lens.project(rays, bare)
    params = np.zeros(len(bare))
    for axis in range(2):
        design = np.column_stack([plane[:, axis], np.ones(len(plane))])
        params[axis], params[2 + axis] = np.linalg.lstsq(design, pixels[:, axis], rcond=None)[0]
    return params[:4] if lens.name in LADDER else params


def _adjusted(lens: LensModel, rays: Points, pixels: Pixels, start: Params) -> Params:
    """The least-squares parameters next to the start. A step that folds the model over a ray is taken back."""
    from scipy.optimize import least_squares

    def residuals(params: Params) -> Floats:
        found = lens.project(rays, params) - pixels
        return np.asarray(np.where(np.isfinite(found), found, FOLDED_PX).ravel(), dtype=np.float64)

    def jacobian(params: Params) -> Floats:
        return lens.project_with_jacobians(rays, params)[2].reshape(-1, len(params))

    if (residuals(start) == FOLDED_PX).any():
        raise InputError(f"the start of the fit does not show all of the image as {lens.name}; give another, or none")
    # MINPACK, because scipy's own method keeps every core busy with singular values of so tall a matrix
    found = least_squares(
        residuals, start, jac=jacobian, method="lm", x_scale="jac", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=300
    )
    return np.asarray(found.x, dtype=np.float64)
