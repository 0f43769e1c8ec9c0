"""A problem as mrcal takes it, and mrcal's solution of it."""

import mrcal
import numpy as np
from descent import finish

PLAIN = {"do_apply_outlier_rejection": False, "do_optimize_calobject_warp": False}
RATIONAL = ("LENSMODEL_OPENCV8", "LENSMODEL_OPENCV12")


def solve(problem):
    """The solution of a problem.

    Both are dicts of arrays. A problem has ``intrinsics`` (P,), ``poses`` (V, 6) as rotation vector and translation,
    ``lensmodels``, the stages to go through from the simplest to the one wanted, ``imagersize`` (2,), and what either
    `grid_arguments` or `point_arguments` wants. Lengths are in any unit.
    """
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
