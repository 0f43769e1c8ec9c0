"""Runs mrcal in a Python that has it: ``worker.py PROBLEM SOLUTION``, two ``.npz`` files, or ``worker.py --version``.

It imports nothing of opencsp-calib: Debian's mrcal is built for another NumPy than ours and lives in Debian's Python.
"""

import sys

if __name__ == "__main__":
    del sys.path[0]  # this folder, whose modules are for the other Python

NO_MRCAL = 3  # exit status
PLAIN = {"do_apply_outlier_rejection": False, "do_optimize_calobject_warp": False}

RATIONAL = ("LENSMODEL_OPENCV8", "LENSMODEL_OPENCV12")
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


def version():
    """The version of mrcal as whoever installed it has it, for mrcal 2.2 does not know its own; None without mrcal."""
    import importlib.metadata
    import importlib.util
    import shutil
    import subprocess

    if importlib.util.find_spec("mrcal") is None:
        return None
    try:
        return importlib.metadata.version("mrcal")
    except importlib.metadata.PackageNotFoundError:
        dpkg = shutil.which("dpkg-query")
    if dpkg is None:
        return "unknown"
    command = [dpkg, "--show", "--showformat=${Version}", "python3-mrcal"]
    return subprocess.run(command, capture_output=True, text=True).stdout.strip() or "unknown"


def solve(problem):
    """The solution of a problem.

    Both are dicts of arrays. A problem has ``intrinsics`` (P,), ``poses`` (V, 6) as rotation vector and translation,
    ``lensmodels``, the stages to go through from the simplest to the one wanted, ``imagersize`` (2,), and what either
    `grid_arguments` or `point_arguments` wants. Lengths are in any unit.
    """
    import mrcal
    import numpy as np

    problem = {name: np.array(value) for name, value in problem.items()}  # mrcal writes into what it is given
    which = grid_arguments if "grid" in problem else point_arguments
    positional, named, last = which(problem)
    named["imagersizes"] = problem["imagersize"][None].astype(np.int32)
    named["do_apply_regularization"] = False  # pulls the principal point to the middle and distortion to zero
    intrinsics, stages = problem["intrinsics"], [str(name) for name in problem["lensmodels"]]
    for stage in stages:
        options = last if stage == stages[-1] else {}
        now = np.zeros((1, mrcal.lensmodel_num_params(stage)))
        shared = min(now.size, intrinsics.size)
        now[0, :shared] = intrinsics[:shared]
        mrcal.optimize(now, *positional, stage, **named, **{**PLAIN, **options})
        intrinsics = now[0]
    if stages[-1] in RATIONAL:
        finish(now, problem["poses"], positional, stages[-1], {**named, **PLAIN, **last}, "grid" in problem)
    solution = {"intrinsics": intrinsics, "poses": problem["poses"]}
    if "grid" in problem:
        rows, columns = problem["grid"].shape[1:3]
        spacing, warp = float(problem["spacing"]), named["calobject_warp"]
        board = mrcal.ref_calibration_object(columns, rows, spacing, calobject_warp=warp)
        solution.update(weights=problem["grid"][..., 2], board=board.reshape(-1, 3))
    return solution


def grid_arguments(problem):
    """Of an even board that moves before the camera.

    ``grid`` (V, rows, columns, 3) x, y and weight, negative where nothing is seen; ``spacing``; ``warp`` and
    ``robust``, whether to solve for mrcal's warp and to reject outliers.
    """
    import numpy as np

    views = np.arange(len(problem["poses"]), dtype=np.int32)
    indices = np.column_stack([views, 0 * views, 0 * views - 1])
    positional = [None, problem["poses"], None, problem["grid"], indices, None, None]
    named = {
        "calobject_warp": np.zeros(2) if problem["warp"] else None,
        "calibration_object_spacing": float(problem["spacing"]),
    }
    last = {
        "do_optimize_calobject_warp": bool(problem["warp"]),
        "do_apply_outlier_rejection": bool(problem["robust"]),
    }
    return positional, named, last


def point_arguments(problem):
    """Of a camera that moves before points that are known, which may be anywhere.

    ``points`` (K, 3); ``observations`` (N, 3) x, y and weight; ``indices`` (N, 3) point, 0, view.
    """
    import numpy as np

    points, indices = problem["points"], problem["indices"].astype(np.int32)
    positional = [
        problem["poses"],
        None,
        points,
        None,
        None,
        problem["observations"],
        indices,
    ]
    # beyond these ranges mrcal would add a penalty of its own
    named = {"Npoints_fixed": len(points), "point_min_range": 1e-6, "point_max_range": 1e9}
    return positional, named, {}


def finish(intrinsics, poses, positional, lensmodel, named, grid):
    """The last steps to the least sum of squares, in place, by mrcal's own residuals and derivatives.

    Mrcal ends where its steps are short, and along the bent valley of a rational lens model that images barely
    determine all of them are. Here steps are damped (Levenberg and Marquardt) for the camera only, and the poses
    follow at once. The damping begins at the least squared singular value, below which it does nothing; it grows where
    a step leads too far or the next one leads back, and falls where that leads on.
    """
    import mrcal
    import numpy as np

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
        import itertools

        import numpy as np

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
        import numpy as np

        return max(np.linalg.svd(self.camera * self.scale, compute_uv=False)[-1] ** 2, 1e-20)

    def step(self, damping):
        """The camera's, and of a warp."""
        import numpy as np

        rows = np.vstack([self.camera * self.scale, np.sqrt(damping) * np.eye(len(self.left))])
        return self.scale * np.linalg.lstsq(rows, np.append(self.left, 0.0 * self.left), rcond=0.0)[0]

    def after(self, step):
        """The state after a step of the camera, the poses following."""
        import numpy as np

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


def main(arguments):
    """See the module; the exit status."""
    if arguments == ["--version"]:
        found = version()
        sys.stdout.write(found or "")
        return 0 if found else NO_MRCAL
    import numpy as np

    problem, solution = arguments
    with np.load(problem, allow_pickle=False) as file:
        solved = solve(dict(file))
    np.savez(solution, **solved)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
