"""Where to start solving from: a focal length without distortion, and a pose for every view.

A view's pose comes from the homography H between the board's plane and the rays of its corners: each corner demands
``ray x (H point) = 0``, so H is the eigenvector of the smallest eigenvalue of the sum of ``(I - ray ray') (x) (point
point')``, and H is [r1 r2 t] up to scale. Rays rather than pixels, so that it holds for any lens model and for rays
beside and behind the camera. The focal length is the one whose poses explain the corners best: a search in one
unknown, which cannot come out negative as the closed form (Zhang 2000) can.
"""

from collections.abc import Sequence
from functools import cache

import numpy as np

from opencsp_calib.arrays import Floats, Ids, Params, Points
from opencsp_calib.camera import Camera
from opencsp_calib.detection import Detection, Observations
from opencsp_calib.errors import InputError
from opencsp_calib.models import LensModel, lens_model
from opencsp_calib.pose import Pose
from opencsp_calib.rotations import rotation_vectors

__all__ = ["initial_camera", "initial_poses", "rough_tilts"]

FOCAL_LENGTHS = np.geomspace(0.15, 30.0, 20)  # in image sides
REFINEMENTS = 6  # each halves the step between focal lengths, of 32 %
SEARCH_VIEWS, SEARCH_CORNERS = 12, 40  # as many as the search for the focal length looks at
CORNERS = 80  # as many as a pose is found from
TOGETHER = 64  # views whose poses are found at once


def initial_camera(
    observations: Observations, model: str, guess: Camera | None = None, pixel_aspect: float | None = None
) -> Camera:
    """A camera to start from: the guess, or the middle of the image, no distortion and the focal length that fits.

    Parameters
    ----------
    observations : Observations
        Used views of at least four corners each.
    model : str
        Of the camera returned. The distortion of a guess of another model is taken over as far as both have it.
    guess : Camera, optional
    pixel_aspect : float, optional
        fy/fx; square pixels by default.

    Raises
    ------
    InputError
        If the guess is for images of another size.
    """
    lens = lens_model(model)
    if guess is None:
        params = _searched(observations, lens, pixel_aspect or 1.0)
    else:
        params = _adapted(guess, observations.image_size, lens)
        if pixel_aspect is not None:
            params[1] = params[0] * pixel_aspect
    return Camera(guess.name if guess else "camera", model, params, observations.image_size)


def initial_poses(camera: Camera, observations: Observations) -> tuple[Pose, ...]:
    """Where the board is in each used view, roughly: for a board about flat.

    Parameters
    ----------
    camera : Camera
    observations : Observations
        Used views of at least four corners each.

    Returns
    -------
    tuple of Pose
        ``cam_from_board``, one per used view.
    """
    poses: list[Pose] = []
    for first in range(0, len(observations.detections), TOGETHER):
        some = observations.detections[first : first + TOGETHER]
        rotations, translations = _PoseSearch(observations.board.points, some, CORNERS).poses(
            camera.lens, camera.params
        )
        poses += (Pose(r, t) for r, t in zip(rotation_vectors(rotations), translations, strict=True))
    return tuple(poses)


def rough_tilts(observations: Observations) -> dict[str, float]:
    """By how many degrees the board is tilted in each used view, by the image's name, before there is a camera.

    Empty where there are no used views: one that is tilted tells the focal length roughly, several tell it better.
    """
    if not observations.used:
        return {}
    poses = initial_poses(initial_camera(observations, "pinhole"), observations)
    return {view.image: pose.tilt_deg for view, pose in zip(observations.used, poses, strict=True)}


def _adapted(guess: Camera, image_size: tuple[int, int], lens: LensModel) -> Params:
    if guess.image_size != image_size:
        sizes = " but the images are ".join("x".join(map(str, size)) for size in (guess.image_size, image_size))
        raise InputError(f"the guess, camera {guess.name!r}, is for images of {sizes}")
    params = np.zeros(len(lens.parameter_names))
    # fisheye coefficients mean something else than those of the same names in the other models
    fisheyes = [name == "opencv_fisheye" for name in (guess.model, lens.name)]
    shared = min(len(params), len(guess.params)) if fisheyes[0] == fisheyes[1] else 4
    params[:shared] = guess.params[:shared]
    return params


def _searched(observations: Observations, lens: LensModel, aspect: float) -> Params:
    size = np.array(observations.image_size, dtype=np.float64)
    views = observations.detections
    search = _PoseSearch(observations.board.points, views[:: -(-len(views) // SEARCH_VIEWS)], SEARCH_CORNERS)

    def params(focal: float) -> Params:
        distortion = np.zeros(len(lens.distortion_names))
        return np.concatenate([[focal, focal * aspect], (size - 1) / 2, distortion])

    @cache
    def misfit(focal: float) -> float:
        return search.misfit(lens, params(focal))

    best = min((float(focal) for focal in size.max() * FOCAL_LENGTHS), key=misfit)
    step = float(FOCAL_LENGTHS[1] / FOCAL_LENGTHS[0])
    for _ in range(REFINEMENTS):
        step = step**0.5
        best = min((best / step, best, best * step), key=misfit)
    return params(best)


class _PoseSearch:
    """Some corners of every view, with what their poses need that no camera changes."""

    def __init__(self, board: Points, views: Sequence[Detection], corners: int) -> None:
        chosen = [_chosen(len(view), corners) for view in views]
        self.lengths = np.array([len(c) for c in chosen])
        self.starts = np.concatenate([[0], np.cumsum(self.lengths)[:-1]])
        self.pixels = np.concatenate([view.pixels[c] for view, c in zip(views, chosen, strict=True)])
        self.points = np.concatenate([board[view.ids[c]] for view, c in zip(views, chosen, strict=True)])
        self.middle = board.mean(axis=0)
        self.axes = np.linalg.svd(board - self.middle, full_matrices=False)[2]
        self.axes[2] *= np.linalg.det(self.axes)
        plane = (self.points - self.middle) @ self.axes.T
        self.scale = float(np.sqrt((plane**2).mean()))
        plane /= self.scale
        plane[:, 2] = 1.0
        self.plane_squares = plane[:, :, None] * plane[:, None, :]

    def poses(self, lens: LensModel, params: Params) -> tuple[Floats, Floats]:
        """(V, 3, 3) rotations and (V, 3) translations, of the board to the camera."""
        rays = np.nan_to_num(lens.unproject(self.pixels, params))
        across = np.eye(3) * (rays**2).sum(axis=1)[:, None, None] - rays[:, :, None] * rays[:, None, :]
        of_rays, of_plane = (np.split(part.reshape(-1, 9), self.starts[1:]) for part in (across, self.plane_squares))
        products = np.array([rays.T @ plane for rays, plane in zip(of_rays, of_plane, strict=True)])
        products = products.reshape(-1, 3, 3, 3, 3)
        sums = products.transpose(0, 1, 3, 2, 4).reshape(-1, 9, 9)
        homographies = np.linalg.eigh(sums)[1][:, :, 0].reshape(-1, 3, 3)
        left, sizes, right = np.linalg.svd(homographies[:, :, :2], full_matrices=False)
        pairs = left @ right  # the orthonormal columns nearest to the first two
        translations = homographies[:, :, 2] * (self.scale / sizes.mean(axis=1))[:, None]
        behind = (translations * np.add.reduceat(rays, self.starts)).sum(axis=1) < 0
        pairs[behind] *= -1.0
        translations[behind] *= -1.0
        third = np.cross(pairs[:, :, 0], pairs[:, :, 1])[:, :, None]
        rotations = np.concatenate([pairs, third], axis=2) @ self.axes
        return rotations, translations - rotations @ self.middle

    def misfit(self, lens: LensModel, params: Params) -> float:
        """Sum of squared residuals, px²; infinite where a corner has no image."""
        rotations, translations = self.poses(lens, params)
        turned = np.einsum("nij,nj->ni", np.repeat(rotations, self.lengths, axis=0), self.points)
        points = turned + np.repeat(translations, self.lengths, axis=0)
        squares = float(((lens.project(points, params) - self.pixels) ** 2).sum())
        return squares if np.isfinite(squares) else np.inf


def _chosen(count: int, wanted: int) -> Ids:
    """Some of the corners, at random, but always the same: every n-th could be all on one line."""
    if count <= wanted:
        return np.arange(count)
    return np.sort(np.random.default_rng(count).permutation(count)[:wanted])
