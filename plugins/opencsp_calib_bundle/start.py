"""Where the iteration starts: a camera and poses that see every corner, each pose in the deeper of its two minima."""

import numpy as np

from opencsp_calib import CalibrationFailedError, Camera, Observations, SolveOptions
from opencsp_calib.arrays import Floats
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.jacobian import residuals
from opencsp_calib.pose_fit import fit_pose
from opencsp_calib.unknowns import Estimate

__all__ = ["start", "with_deeper_minima"]

CLEAR = 30.0
"""A board whose depth shows by this many times the residuals cannot be taken for its mirror image."""


def start(observations: Observations, model: str, options: SolveOptions, table: CornerTable) -> Estimate:
    """A camera, from the guess or found, and poses that see every corner of the table, before anything is minimised.

    Raises
    ------
    CalibrationFailedError
        If no pose of a view puts its corners before the camera.
    """

    def posed(camera: Camera) -> Estimate:
        return Estimate.posed(camera.params, initial_poses(camera, observations), observations.board.points)

    camera = initial_camera(observations, model, options.guess, options.pixel_aspect)
    estimate = posed(camera)
    if np.isnan(residuals(camera.lens, table, estimate)).any() and camera.distortion.any():
        # the guess's distortion folds back before the outermost corners: its other numbers may still serve
        camera = Camera(camera.name, model, np.r_[camera.params[:4], 0.0 * camera.distortion], camera.image_size)
        estimate = posed(camera)
    lost = np.isnan(residuals(camera.lens, table, estimate)).any(axis=1)
    if lost.any():
        image = observations.used[int(table.view[lost][0])].image
        message = f"no start from {image}: its corners do not fit the board seen from anywhere; drop it"
        raise CalibrationFailedError(message)
    return estimate


def with_deeper_minima(observations: Observations, camera: Camera, estimate: Estimate, table: CornerTable) -> Estimate:
    """The same with the poses of views that could be mirrored fitted from both sides.

    Seen from afar, a board tilted away looks almost like one tilted towards the camera. Which of the two a linear
    solution is nearer to, noise and a start without distortion decide.
    """
    rms = _view_rms(camera, estimate, table)
    unclear = np.flatnonzero(_depth_px(camera, estimate) < CLEAR * rms)
    rotations, translations = estimate.rotations.copy(), estimate.translations.copy()
    for view in unclear:
        try:
            pose = fit_pose(camera, observations.board, observations.detections[view])
        except CalibrationFailedError:
            continue  # what there is stays
        rotations[view], translations[view] = pose.matrix, pose.translation
    other = Estimate(estimate.params, rotations, translations, estimate.points)
    deeper = _view_rms(camera, other, table) < rms  # NaN, where a corner has no image, is not
    return Estimate(
        estimate.params,
        np.where(deeper[:, None, None], rotations, estimate.rotations),
        np.where(deeper[:, None], translations, estimate.translations),
        estimate.points,
    )


def _depth_px(camera: Camera, estimate: Estimate) -> Floats:
    """(V,) how far the nearer half of the board's outline lies out by perspective, px: what a mirror image lacks."""
    points = estimate.points - estimate.points.mean(axis=0)
    middle = estimate.translations + estimate.rotations @ estimate.points.mean(axis=0)
    distance = np.linalg.norm(middle, axis=1)
    depth = np.abs(points @ (estimate.rotations.transpose(0, 2, 1) @ middle[:, :, None])[:, :, 0].T).max(axis=0)
    half = np.linalg.norm(points, axis=1).max()
    return np.asarray(camera.params[0] * half * depth / distance**3)


def _view_rms(camera: Camera, estimate: Estimate, table: CornerTable) -> Floats:
    squares = (residuals(camera.lens, table, estimate) ** 2).sum(axis=1)
    return np.sqrt(np.add.reduceat(squares, table.first[:-1]) / table.counts)
