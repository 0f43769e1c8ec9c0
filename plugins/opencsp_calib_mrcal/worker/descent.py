"""The last steps to the least sum of squares, by mrcal's own residuals and derivatives.

Mrcal ends where its steps are short, and along the bent valley of a rational lens model that images barely determine
all of them are. Here steps are damped (Levenberg and Marquardt) for the camera only, and the poses follow at once. The
damping begins at the least squared singular value, below which it does nothing; it grows where a step leads too far or
the next one leads back, and falls where that leads on.
"""

import itertools

import mrcal
import numpy as np

ENOUGH = 1e-16  # of the sum of squares left to gain: some 1e-6 sigmas
NEAR = 1e-12  # variances left to gain: where nothing but rounding keeps a step from leading on
FARTHEST = 10.0  # sigmas; from farther away mrcal has found something else
EXACT_PX = 1e-3  # no corner is located better: pixels without noise are judged as if they had this
ROUNDING = 1e-9  # of the sum of squares: what its digits can tell for certain
CLOSE = 1e-2  # variances left to gain: from where on poses need no fit of their own
QUICK = 0.1  # of what was left to gain: the damping that leaves less than that is kept
MORE, LESS = 5.0, 0.2  # times the damping
STEPS, MOST_DAMPING = 80, 1.0
POSE = 6


def finish(intrinsics, poses, positional, lensmodel, named, grid):
    """Leads a solution to where the sum of squares is least, in place.

    ``intrinsics`` (1, P), ``poses`` (V, 6), then the other arguments of mrcal's ``optimize`` by position, the name of
    the lens model, and those by name; ``grid`` tells whether the board moves or the camera.
    """
    views = len(poses)
    warp = named["calobject_warp"] if named["do_optimize_calobject_warp"] else np.zeros(0)
    state = mrcal.optimizer_callback(
        intrinsics, *positional, lensmodel, **named, no_jacobian=True, no_factorization=True
    )[0]
    scale = np.ones_like(state)  # of mrcal's state, which has no units
    counts = {"Nframes" if grid else "Ncameras_extrinsics": views, "Ncameras_intrinsics": 1}
    mrcal.unpack_state(scale, lensmodel=lensmodel, do_optimize_calobject_warp=bool(warp.size), **counts)

    def at(state):
        values = np.split(state * scale, [intrinsics.size, intrinsics.size + poses.size])
        for array, value in zip((intrinsics, poses, warp), values, strict=True):
            array[...] = value.reshape(array.shape)
        _, left, derivatives, _ = mrcal.optimizer_callback(
            intrinsics, *positional, lensmodel, **named, no_factorization=True
        )
        return Place(state, left, derivatives, intrinsics.size, views)

    here = at(state)
    variance = max(here.cost / here.numbers, EXACT_PX**2)
    if here.promised < FARTHEST**2 * variance:
        try:
            for place in descent(here, at, variance):
                state = place.state
        except np.linalg.LinAlgError:  # a place from which there is no step: the one before it is taken
            pass
    at(state)


def descent(here, at, variance):
    """Lower and lower places, until hardly anything is left to gain."""
    damping = 0.0
    for _ in range(STEPS):
        if here.promised <= ENOUGH * here.cost:
            return
        step = here.step(damping)
        there = at(here.after(step))
        if not there.lower(here, step) and here.promised > CLOSE * variance:
            there = at(there.after(0.0 * step))
        if damping > MOST_DAMPING or (here.promised < NEAR * variance and not there.promised < here.promised):
            return
        if there.lower(here, step):
            if there.promised > QUICK * here.promised:
                back = there.slope(step) < 0.0
                damping = max(MORE * damping, there.least_damping()) if back else LESS * damping
            here = there
            yield here
        else:
            damping = max(MORE * damping, here.least_damping())


class Place:
    """A state and the sum of squares around it, each view's pose eliminated by an orthogonal triangulation."""

    def __init__(self, state, left, derivatives, lens, views):
        self.state, self.cost, self.numbers = state, left @ left, len(left)
        self.in_pose = in_pose = np.zeros(len(state), dtype=bool)
        in_pose[lens : lens + POSE * views] = True
        self.others = np.flatnonzero(~in_pose)
        column = np.empty(len(state), dtype=int)  # of each unknown in its view's rows: its pose first
        column[in_pose] = np.tile(np.arange(POSE), views)
        column[self.others] = POSE + np.arange(len(self.others))
        entries = derivatives.tocoo()
        rows = np.zeros((len(left), POSE + len(self.others) + 1))
        rows[entries.row, column[entries.col]] = entries.data
        rows[:, -1] = -left
        view = np.full(len(left), views)  # rows that no pose changes tell nothing
        of_pose = in_pose[entries.col]
        view[entries.row[of_pose]] = (entries.col[of_pose] - lens) // POSE
        order = np.argsort(view, kind="stable")
        bounds = np.searchsorted(view[order], np.arange(views + 1))
        lacking = [(0, rows.shape[1]), (0, 0)]
        of_view = [np.pad(rows[order[begin:end]], lacking) for begin, end in itertools.pairwise(bounds)]
        self.views = np.array([np.linalg.qr(rows, mode="r") for rows in of_view])
        triangle = np.linalg.qr(self.views[:, POSE:, POSE:].reshape(-1, len(self.others) + 1), mode="r")
        self.camera, self.left = triangle[:-1, :-1], triangle[:-1, -1]
        self.promised = self.left @ self.left
        self.scale = 1.0 / np.linalg.norm(self.camera, axis=0)

    def least_damping(self):
        """What first does anything to a step."""
        return max(np.linalg.svd(self.camera * self.scale, compute_uv=False)[-1] ** 2, 1e-20)

    def step(self, damping):
        """The camera's, and of a warp."""
        rows = np.vstack([self.camera * self.scale, np.sqrt(damping) * np.eye(len(self.left))])
        return self.scale * np.linalg.lstsq(rows, np.append(self.left, 0.0 * self.left), rcond=0.0)[0]

    def after(self, step):
        """The state after a step of the camera, the poses following."""
        of_poses = self.views[:, :POSE, -1] - self.views[:, :POSE, POSE:-1] @ step
        poses = np.linalg.solve(self.views[:, :POSE, :POSE], of_poses[:, :, None])
        moved = self.state.copy()
        moved[self.others] += step
        moved[self.in_pose] += poses.ravel()
        return moved

    def lower(self, other, step):
        """Whether the sum of squares is lower than before a step; by the slopes where its own digits cannot tell."""
        if self.cost < other.cost * (1.0 - ROUNDING):
            return True
        return self.cost <= other.cost * (1.0 + ROUNDING) and self.slope(step) + other.slope(step) > 0.0

    def slope(self, step):
        """Half of by how much the sum of squares falls along a step, were its slope the same all the way."""
        return (self.camera @ step) @ self.left
