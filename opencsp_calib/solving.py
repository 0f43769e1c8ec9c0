"""What every solver does before and after its engine runs: refuse what cannot be solved, and what cannot be true."""

from collections.abc import Sequence

import numpy as np

from opencsp_calib.arrays import Floats, Mask, Params
from opencsp_calib.board import Board
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.counted import counted
from opencsp_calib.detection import Observations, Problem
from opencsp_calib.errors import CalibrationFailedError, InputError
from opencsp_calib.interfaces import Solver
from opencsp_calib.models import lens_model
from opencsp_calib.options import SolveOptions
from opencsp_calib.pose import Pose
from opencsp_calib.pose_fit import MIN_CORNERS, on_one_line

__all__ = ["ABILITIES", "MIN_CORNERS", "check_request", "finished"]

ABILITIES = {
    "guess": "start from a guess",
    "board_warp": "solve for a warp of the board",
    "board_free": "solve for the board's shape",
    "pixel_aspect": "hold the pixel aspect",
    "weights": "weight corners by their covariance",
    "robust": "leave out outlying corners",
}
MIN_VIEWS = 2  # of a flat board; one view of a plane does not determine a camera
SIMPLE = 5  # distortion coefficients, which most sets of photographs tell
SIMPLER = "take a simpler lens model, such as opencv4, or more views that reach the image's corners"
ADVICE = "check the board's description and the photographs, add tilted views or take a simpler model"
SHORTEST_FOCAL = 0.05  # of the image's longer side: a fisheye that sees all around has 0.16


def check_request(solver: Solver, observations: Observations, model: str, options: SolveOptions) -> None:
    """Refuse what a solver is not able to do, and what nobody can solve; engines would guess, crash or ignore it.

    Parameters
    ----------
    solver : Solver
    observations : Observations
    model : str
        Name of a lens model.
    options : SolveOptions

    Raises
    ------
    InputError
        If the solver has not the lens model or an ability asked for, there are too few views or corners, a view has
        too few corners or all on one line, or a weight is asked for that is not there.
    """
    size = len(lens_model(model).parameter_names)
    if model not in solver.models:
        able = ", ".join(sorted(solver.models))
        raise InputError(f"the solver {solver.name!r} has no lens model {model!r}; it has {able}")
    lacking = sorted(options.asked - solver.abilities)
    if lacking:
        raise InputError(f"the solver {solver.name!r} cannot {' or '.join(ABILITIES[name] for name in lacking)}")
    used = observations.used
    if len(used) < MIN_VIEWS:
        raise InputError(
            f"{counted(len(used), 'usable view')}: at least {MIN_VIEWS} are needed, and 10 or more are wise"
        )
    for view in used:
        ids = view.detection.ids
        if len(ids) < MIN_CORNERS or on_one_line(observations.board.points[ids]):
            raise InputError(
                f"{view.image} has {counted(len(ids), 'corner')}; a view needs {MIN_CORNERS}, not all on one line; "
                "drop it"
            )
        if options.weights == "covariance" and view.detection.covariance is None:
            raise InputError(f"{view.image} has corners without covariance; refine them, or take equal weights")
    equations = 2 * sum(len(view.detection) for view in used)
    unknowns = size + 6 * len(used)
    if equations < unknowns:
        raise InputError(
            f"{equations // 2} corners in {len(used)} views are too few for the {unknowns} unknowns of {model!r}; "
            "take more views or a simpler model"
        )


def finished(
    solver: Solver,
    observations: Observations,
    model: str,
    options: SolveOptions,
    params: Params,
    rotations: Floats,
    translations: Floats,
    *,
    board: Board | None = None,
    outliers: Sequence[Mask] | None = None,
    problems: tuple[Problem, ...] = (),
) -> Calibration:
    """What an engine found as a `Calibration`, if it can be true.

    Parameters
    ----------
    solver, observations, model, options
        As given to `Solver.solve`.
    params : (P,)
        Of the lens model.
    rotations : (V, 3) rad
        Rotation vectors, one per used view, of the board to the camera.
    translations : (V, 3) m
    board : Board, optional
        As solved; by default that of the observations.
    outliers : (n,) bool per used view, optional
    problems : tuple of Problem

    Raises
    ------
    CalibrationFailedError
        If a number is not finite, a focal length is shorter than any lens's, the principal point is further outside
        of the image than the image is large, or a used corner has no image: behind the camera, or where the lens model
        folds back.
    """
    engine = f"{solver.name} {solver.version()}"
    numbers = np.concatenate([params, np.ravel(rotations), np.ravel(translations)])
    size = np.array(observations.image_size)
    if not np.isfinite(numbers).all() or not (params[:2] > SHORTEST_FOCAL * size.max()).all():
        raise CalibrationFailedError(f"{engine} found no solution for {model!r}: {ADVICE}")
    if (np.abs(params[2:4] - size / 2) > 1.5 * size).any():
        x, y = params[2:4]
        message = f"{engine} puts the principal point at ({x:.0f}, {y:.0f}), far outside of the image: {ADVICE}"
        raise CalibrationFailedError(message)
    name = options.guess.name if options.guess else "camera"
    calibration = Calibration(
        camera=Camera(name, model, params, observations.image_size),
        observations=observations,
        cam_from_board=tuple(Pose(r, t) for r, t in zip(rotations, translations, strict=True)),
        board=board or observations.board,
        solver=engine,
        options=options,
        outliers=outliers,  # type: ignore[arg-type]  # None stands for none
        problems=problems,
    )
    _check_seen(calibration)
    return calibration


def _check_seen(calibration: Calibration) -> None:
    """A camera that has no image of a corner that it was solved from is none."""
    camera, board, views = calibration.camera, calibration.board, calibration.observations.used
    parts = zip(views, calibration.cam_from_board, calibration.residuals, calibration.outliers, strict=True)
    for view, pose, residuals, outliers in parts:
        lost = np.isnan(residuals).any(axis=1) & ~outliers
        if not lost.any():
            continue
        corners = f"{lost.sum()} of the corners of {view.image}"
        if (pose.transform(board.points[view.detection.ids[lost]])[:, 2] <= 0).any():
            raise CalibrationFailedError(f"{calibration.solver} found a camera that has {corners} behind it: {ADVICE}")
        cure = f"{camera.model!r} has more coefficients than these photographs tell: {SIMPLER}"
        raise CalibrationFailedError(
            f"{calibration.solver} found a camera whose distortion folds back inside the image, as no lens does, so "
            f"that it cannot see {corners}; {cure if len(camera.distortion) > SIMPLE else ADVICE}"
        )
