"""One Newton step of a calibration: where it would be with something else solved for, if that is not far."""

from dataclasses import replace

from opencsp_calib.calibration import Calibration
from opencsp_calib.normal_equations import normal_equations
from opencsp_calib.schur import factorise

__all__ = ["stepped"]


def stepped(calibration: Calibration) -> Calibration:
    """The calibration one step nearer to the least sum of squares of what its options ask for.

    Parameters
    ----------
    calibration : Calibration
        Its options may be others than those it was solved with.

    Returns
    -------
    Calibration
        Camera, poses and board moved; its uncertainty is not known.

    Raises
    ------
    numpy.linalg.LinAlgError
        If the observations do not determine all that is asked for.
    """
    equations = normal_equations(calibration)
    shared, corner, pose = factorise(equations).solve(equations.gradient)
    moved = equations.estimate.moved(equations.unknowns, -shared, -corner, -pose)
    return Calibration(
        camera=replace(calibration.camera, params=moved.params),
        observations=calibration.observations,
        cam_from_board=moved.poses,
        board=calibration.board.with_points(moved.points),
        solver=calibration.solver,
        options=calibration.options,
        outliers=calibration.outliers,
    )
