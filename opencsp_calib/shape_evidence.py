"""What speaks for solving for the board's shape: read from one linearisation, without solving for it.

A board taken as flat that is not spoils the camera far beyond what its rms shows. A flat one whose shape is solved
for costs little: sigmas 1.9, 1.5, 1.2 times as large at 10, 20, 50 views. rms and held-out rms always prefer the
shape. Two things tell whether it is worth its price:

*   the odd and the even views, solved apart, agree clearly better over the image with the shape than without it; or
*   solving for the shape moves the camera by more than chance explains. Halves cannot see an error that both of them
    share, and two halves with like poses share most of what a bent board does: of worlds with a board 0.5 mm out of
    flat and noise of 0.1 px they get most wrong, with the camera off by ten sigmas. (An estimate that is right either
    way is held against one that is right only if the board is flat: Hausman 1978.) What chance explains is the
    jackknife sigma of the move itself: how far it changes when each view in turn is left out.

Neither counts where solving moves the camera by next to nothing: what all views' corners are wrong by in the same way
does as much, and no more views make it less.

Nothing of that needs a solution with the shape. One Newton step from the one without it goes to it within a hundredth,
and where it would not, the board is so bent that there is nothing to decide. The steps of the halves, and of all views
but one, are solved for in the same normal equations.
"""

from dataclasses import dataclass, replace

import numpy as np

from opencsp_calib.arrays import Floats, Params
from opencsp_calib.calibration import Calibration
from opencsp_calib.camera import Camera
from opencsp_calib.leaving_out import camera_without_each_view
from opencsp_calib.normal_equations import NormalEquations, normal_equations
from opencsp_calib.options import SolveOptions
from opencsp_calib.projection_sigma import Alignment
from opencsp_calib.resampling import half_steps
from opencsp_calib.schur import factorise
from opencsp_calib.uncertainty import jackknife_covariance

__all__ = ["Evidence", "evidence_of"]

CLEARLY = 1.5  # two halves are one draw of a figure that scatters by about half: less is chance
SIGMAS = 2.0  # a camera that moves by more has, by about 20 to 1, a bias that outweighs what the shape adds to chance
LEAST_MOVE_PX = 0.003  # twice what corners in sharp photographs are wrong by on average (validation/results/corners.md)
CLOSE = 1e-2  # of a step: jackknife sigmas scatter by a part of 1/sqrt(2 V), 10 % of 50 views


@dataclass(frozen=True)
class Evidence:
    """What speaks for and against the board's shape, all rms over the image after aligning the frames.

    Parameters
    ----------
    given_halves_px, solved_halves_px : float
        How far apart the halves are with the board as given, and with its shape solved for.
    moved_px, sigma_px : float
        How far solving for the shape moves the camera, and how far chance would.
    """

    given_halves_px: float
    solved_halves_px: float
    moved_px: float
    sigma_px: float

    @property
    def by_halves(self) -> bool:
        """Whether the halves agree clearly better with the shape."""
        return CLEARLY * self.solved_halves_px < self.given_halves_px

    @property
    def by_move(self) -> bool:
        """Whether solving for the shape moves the camera by more than chance."""
        return self.moved_px > SIGMAS * self.sigma_px

    @property
    def for_shape(self) -> bool:
        """Whether one of the two speaks for it, and it is worth solving for."""
        return self.matters and (self.by_halves or self.by_move)

    @property
    def matters(self) -> bool:
        """Whether solving for the shape moves the camera by more than errors that the corners of all views share."""
        return self.moved_px > LEAST_MOVE_PX

    def __str__(self) -> str:
        """Only what decided is given as the reason."""
        moved, chance = f"the camera by {self.moved_px:.2g} px", f"chance explains ({self.sigma_px:.2g} px typically)"
        halves = f"differ by {self.solved_halves_px:.2g} instead of {self.given_halves_px:.2g} px"
        if not self.matters:
            return f"solving for its shape would move {moved}, which is within the accuracy of the corners"
        if self.by_halves:
            return f"halves of the views then {halves}; it moves {moved}"
        if self.by_move:
            return f"it moves {moved}, more than {chance}"
        return f"solving for its shape would move {moved}, which {chance}, and halves of the views would then {halves}"


def evidence_of(given: Calibration, shape: SolveOptions) -> Evidence:
    """What the normal equations at a solution tell of the one with the board's shape.

    Parameters
    ----------
    given : Calibration
        With the board as given.
    shape : SolveOptions
        With which the shape would be solved for.

    Raises
    ------
    numpy.linalg.LinAlgError, CalibrationFailedError
        If the views, or half of them, do not determine the shape.
    """
    camera = _with_aspect(given.camera, shape.pixel_aspect)
    flat = normal_equations(given)
    table = flat.table if shape.weights == given.options.weights else None
    free = normal_equations(replace(given, camera=camera, options=shape), table)
    step, by_chance = _move(flat, free)
    moved = camera.params - given.camera.params + step
    seen = Alignment.at_infinity(given.camera).grid_jacobian

    def over_image(change: Params) -> float:
        return float(np.sqrt(((seen @ change) ** 2).sum(axis=1).mean()))

    sigma = np.sqrt(np.einsum("nip,pq,niq->n", seen, jackknife_covariance(by_chance), seen).mean())
    given_halves, solved_halves = (over_image(_between(half_steps(equations))) for equations in (flat, free))
    return Evidence(given_halves, solved_halves, over_image(moved), float(sigma))


def _move(flat: NormalEquations, free: NormalEquations) -> tuple[Params, Floats]:
    """A step (P,) of the camera towards the board's shape; (V, P) how each view, left out, changes it from none."""
    solved = factorise(free)  # with many views the largest thing in memory: gone before the halves have theirs
    step = solved.step_without_poses()
    left_out = camera_without_each_view(solved, ahead=step, tolerance=CLOSE)
    return free.unknowns.of_camera(step), left_out - camera_without_each_view(factorise(flat))


def _between(halves: Floats) -> Params:
    return np.asarray(halves[1] - halves[0])


def _with_aspect(camera: Camera, aspect: float | None) -> Camera:
    """The camera with fy/fx as it is to be held."""
    if aspect is None:
        return camera
    params = camera.params.copy()
    params[1] = aspect * params[0]
    return replace(camera, params=params)
