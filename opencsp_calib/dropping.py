"""Leaving bad images out: by name, the worst few, or all above an rms; then solving again."""

from collections.abc import Collection, Iterable

from opencsp_calib.calibration import LEAST_VIEWS, Calibration, Solve
from opencsp_calib.counted import counted
from opencsp_calib.detection import Observations, Problem
from opencsp_calib.errors import InputError
from opencsp_calib.quality import worst_views

__all__ = ["check_dropping", "drop_above", "drop_worst", "excluding"]

MAX_NAMED = 8  # images in a message


def check_dropping(
    images: Collection[str], exclude: Collection[str], worst: int = 0, select: int | None = None
) -> None:
    """Whether so much can be left out of images of these names at all; to be asked before any is looked at.

    Parameters
    ----------
    images : collection of str
        The names of all.
    exclude : collection of str
        Those left out by name.
    worst : int
        How many more are left out, of the largest rms.
    select : int, optional
        How many are kept before that.

    Raises
    ------
    InputError
        If there is no image of such a name, or fewer than `LEAST_VIEWS` would be left.
    """
    _check_names(exclude, images)
    kept = len(set(images) - set(exclude))
    left = max(min(kept, select or kept) - worst, 0)
    if left < LEAST_VIEWS and (exclude or worst):
        raise InputError(f"{left} of {counted(len(images), 'image')} would be left: at least {LEAST_VIEWS} must be")


def excluding(observations: Observations, names: Iterable[str]) -> Observations:
    """Without the named images.

    Raises
    ------
    InputError
        If there is no image of that name.
    """
    names = list(names)
    _check_names(names, [view.image for view in observations.views])
    return observations.dropping(names, Problem("excluded", "left out because you said so"))


def drop_worst(calibration: Calibration, count: int, solve: Solve) -> Calibration:
    """Without the views of the largest rms, solved again.

    Raises
    ------
    InputError
        If fewer than `LEAST_VIEWS` views would be left.
    """
    used = calibration.observations.used
    if count < 0 or len(used) - count < LEAST_VIEWS:
        raise InputError(f"cannot drop {count} of {len(used)} views: at least {LEAST_VIEWS} must be left")
    return _without(calibration, [used[index].image for index in worst_views(calibration, count)], solve)


def drop_above(calibration: Calibration, limit_px: float, solve: Solve) -> Calibration:
    """Without the views whose rms is above a limit, solved again, until none is.

    Raises
    ------
    InputError
        If fewer than `LEAST_VIEWS` views would be left.
    """
    while True:
        used = calibration.observations.used
        above = [view.image for view, rms in zip(used, calibration.view_rms_px, strict=True) if rms > limit_px]
        if not above:
            return calibration
        if len(used) - len(above) < LEAST_VIEWS:
            raise InputError(
                f"the rms of {len(above)} of {len(used)} views is above {limit_px:g} px; at least {LEAST_VIEWS} must "
                "be left: take better photographs, or raise the limit"
            )
        calibration = _without(calibration, above, solve)


def _check_names(names: Iterable[str], images: Collection[str]) -> None:
    known = sorted(images)
    for name in names:
        if name not in images:
            more = f" and {len(known) - MAX_NAMED} more" if len(known) > MAX_NAMED else ""
            raise InputError(f"there is no image {name!r} to exclude; there are {', '.join(known[:MAX_NAMED])}{more}")


def _without(calibration: Calibration, names: list[str], solve: Solve) -> Calibration:
    rms = {v.image: r for v, r in zip(calibration.observations.used, calibration.view_rms_px, strict=True)}
    observations = calibration.observations
    for name in names:
        problem = Problem("dropped", f"left out: its rms was {rms[name]:.3f} px before")
        observations = observations.dropping([name], problem)
    return solve(observations)
