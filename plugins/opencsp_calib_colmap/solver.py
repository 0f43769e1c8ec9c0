"""The solver ``colmap``: COLMAP's bundle adjuster, that is Ceres with analytic derivatives, through pycolmap."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from types import ModuleType
from typing import Any

import numpy as np

from opencsp_calib import Calibration, CalibrationFailedError, Camera, InputError, Observations, Pose, SolveOptions
from opencsp_calib.arrays import Floats, Mask, Points
from opencsp_calib.convergence import determined
from opencsp_calib.corner_table import CornerTable
from opencsp_calib.free_board import laid_on_given, with_lone_corners
from opencsp_calib.initial import initial_camera, initial_poses
from opencsp_calib.rotations import rotation_vectors
from opencsp_calib.solving import check_request, finished
from opencsp_calib.unknowns import Estimate
from opencsp_calib_colmap.cameras import HALF_PIXEL, MODELS, colmap_params, our_params

__all__ = ["ColmapSolver"]

CAMERA = 1
ITERATIONS = 300
SMALLEST_STEP = 1e-14  # as a part of the parameters: Ceres goes on as long as double precision lets it


class ColmapSolver:
    """The board as a scene of constant or variable points, each view as an image with a pose of its own.

    Variable points are left entirely free and the board is brought to the nominal one afterwards: to hold three of
    its points at nominal places instead, as is usual, would bias the camera.
    """

    name = "colmap"
    models = frozenset(MODELS)
    abilities = frozenset({"guess", "board_free"})

    def missing(self) -> str | None:
        """See `Provided.missing`."""
        return None if find_spec("pycolmap") else "it needs pycolmap: pip install 'opencsp-calib[colmap]'"

    def version(self) -> str:
        """See `Solver.version`."""
        import pycolmap

        return str(pycolmap.__version__)

    def solve(self, observations: Observations, model: str, options: SolveOptions) -> Calibration:
        """See `Solver.solve`."""
        import pycolmap

        check_request(self, observations, model, options)
        camera = initial_camera(observations, model, options.guess)
        poses = initial_poses(camera, observations)
        unit = float(np.ptp(observations.board.nominal_points, axis=0).max())
        table = CornerTable.of(observations.detections)
        times = np.bincount(table.ids, minlength=len(observations.board.points))
        free = options.board_shape == "free"
        once = 0 if free else int((times == 1).sum())
        if once:
            message = f"COLMAP takes no corner that one view alone sees, and there are {once}; take another solver"
            raise InputError(message)
        # of a free point that one view alone sees COLMAP wants to know nothing
        scene = _scene(pycolmap, observations, camera, poses, unit, times > (1 if free else 0))
        _adjust(pycolmap, scene, free=free)
        params = our_params(scene.cameras[CAMERA].params)
        rotations, translations = _poses(scene, len(poses))
        board = observations.board
        if free:
            estimate = Estimate(params, rotations, translations, _points(scene, len(board.points)))
            estimate = laid_on_given(board.points, estimate, np.flatnonzero(times > 1))
            estimate = with_lone_corners(camera.lens, table, estimate)
            board, rotations = board.with_points(estimate.points), estimate.rotations
            translations = estimate.translations
        else:
            translations = translations * unit
        vectors = rotation_vectors(rotations)
        calibration = finished(self, observations, model, options, params, vectors, translations, board=board)
        _check_in_front(calibration)
        return determined(calibration)


def _scene(
    pycolmap: ModuleType,
    observations: Observations,
    camera: Camera,
    poses: tuple[Pose, ...],
    unit: float,
    wanted: Mask,
) -> Any:
    """A reconstruction whose point ids are corner ids + 1, image ids view numbers + 1, lengths in units.

    Only the wanted corners (K,) take part.
    """
    width, height = camera.image_size
    scene = pycolmap.Reconstruction()
    scene.add_camera_with_trivial_rig(
        pycolmap.Camera(
            camera_id=CAMERA,
            model=MODELS[camera.model],
            width=width,
            height=height,
            params=colmap_params(camera.params),
        )
    )
    for corner, point in enumerate(observations.board.points / unit, start=1):
        scene.add_point3D_with_id(corner, pycolmap.Point3D(xyz=point))
    for number, (detection, pose) in enumerate(zip(observations.detections, poses, strict=True), start=1):
        image = pycolmap.Image(
            name=str(number), keypoints=detection.pixels + HALF_PIXEL, camera_id=CAMERA, image_id=number
        )
        cam_from_world = pycolmap.Rigid3d(np.column_stack([pose.matrix, pose.translation / unit]))
        scene.add_image_with_trivial_frame(image, cam_from_world)
        for index, corner in enumerate(detection.ids):
            if not wanted[corner]:
                continue
            scene.add_observation(int(corner) + 1, pycolmap.TrackElement(number, index))
    return scene


def _adjust(pycolmap: ModuleType, scene: Any, *, free: bool) -> None:
    config = pycolmap.BundleAdjustmentConfig()
    for image in scene.images:
        config.add_image(image)
    for point in scene.points3D:
        if scene.points3D[point].track.length() and not free:
            config.add_constant_point(point)
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_principal_point = True
    options.print_summary = False
    solver = options.ceres.solver_options
    solver.max_num_iterations = ITERATIONS
    solver.function_tolerance = 0.0
    solver.gradient_tolerance = 0.0
    solver.parameter_tolerance = SMALLEST_STEP
    solver.num_threads = 1  # with more, sums and so results differ from run to run; and it is hardly quicker
    try:
        with _quiet(pycolmap):
            summary = pycolmap.create_default_bundle_adjuster(options, config, scene).solve()
    except (RuntimeError, ValueError) as error:
        raise CalibrationFailedError(f"COLMAP failed: {' '.join(str(error).split())}") from error
    if not summary.is_solution_usable():
        raise CalibrationFailedError(f"COLMAP found no solution: {summary.brief_report()}")


@contextmanager
def _quiet(pycolmap: ModuleType) -> Iterator[None]:
    """Without Ceres' line on the standard error for every step that failed: it goes on, and the end is judged here."""
    before = pycolmap.logging.minloglevel
    pycolmap.logging.minloglevel = pycolmap.logging.Level.ERROR.value
    try:
        yield
    finally:
        pycolmap.logging.minloglevel = before


def _poses(scene: Any, views: int) -> tuple[Floats, Floats]:
    """(V, 3, 3) rotations and (V, 3) translations, in the order of the views."""
    matrices = np.array([scene.images[number].cam_from_world().matrix() for number in range(1, views + 1)])
    return matrices[:, :, :3], matrices[:, :, 3]


def _points(scene: Any, count: int) -> Points:
    return np.array([scene.points3D[corner].xyz for corner in range(1, count + 1)])


def _check_in_front(calibration: Calibration) -> None:
    """COLMAP drops a corner beside or behind the camera from the sum without a word, also for fisheye."""
    pairs = zip(calibration.cam_from_board, calibration.observations.used, strict=True)
    for pose, view in pairs:
        if not (pose.transform(calibration.board.points[view.detection.ids])[:, 2] > 0).all():
            raise CalibrationFailedError(
                f"{calibration.solver} cannot use corners at right angles to the optical axis or beyond, as "
                f"{view.image} has; drop it or take another solver"
            )
