"""Which fits are corners of a checkerboard, and why the others are not."""

from collections import Counter

import numpy as np

from opencsp_calib.arrays import Covariances, Floats, Mask
from opencsp_calib.corner_fit import CornerFit
from opencsp_calib.corner_grid import displaced, parity
from opencsp_calib.corner_windows import NEAR, Surroundings
from opencsp_calib.detection import Detection, RejectedCorner

__all__ = ["moved", "rejections", "summary"]

MOST_MOVED_PX = 3.0
MOST_QUARTER_MISFIT = 0.2  # of the amplitude; a quarter that is half covered has 1
MOST_UNEVEN_SATURATION = 0.2  # of opposite quarters
MOST_MISFIT = 0.1  # of the amplitude; real photographs have up to 0.07
USUAL_MISFIT = 2.0  # times what is usual in the image: moire is everywhere, and what it costs is stated; but not
MOST_USUAL_MISFIT = 0.3  # more than this
MOST_BLUR = 0.5  # of a square's side
MOST_DEVIATION_PX = 0.3
GLARING = 0.8  # of white, for what should be black


def moved(fit: CornerFit, detection: Detection) -> Mask:
    """(n,) whether a fit ended too far from where the corner was found."""
    return np.asarray(np.linalg.norm(fit.pixels - detection.pixels, axis=1) > MOST_MOVED_PX)


def rejections(
    fit: CornerFit,
    start: CornerFit,
    detection: Detection,
    covariance: Covariances,
    around: Surroundings,
    columns: int,
) -> list[RejectedCorner | None]:
    """For each corner why it cannot be trusted; None where it can.

    Parameters
    ----------
    fit, start : CornerFit
        Of n corners.
    detection : Detection
        Where they were looked for.
    covariance : (n, 2, 2) px²
    around : Surroundings
    columns : int
        Of the board's corners.
    """
    colours = np.sign(fit.amplitude) * parity(detection.ids, columns)
    usual = np.sign(colours[fit.converged].sum())
    brighter, darker = fit.quarter_misfit.max(axis=1), fit.quarter_misfit.min(axis=1)
    glaring = start.dark > GLARING * around.white
    deviation = np.sqrt(np.trace(covariance, axis1=1, axis2=2))
    verdicts = [
        ("no corner beside it tells how large its squares are", ~np.isfinite(around.lengths).all(axis=1)),
        ("at the image border", np.isnan(around.windows(start, NEAR)[:, 0])),
        ("glare", ~fit.converged & glaring),
        ("does not look like a corner", ~fit.converged),
        ("moved too far from where it was found", moved(fit, detection)),
        ("black and white are exchanged", colours != usual),
        ("too blurred", fit.blur_px > MOST_BLUR * around.lengths.min(axis=1)),
        ("glare", (brighter > MOST_QUARTER_MISFIT) | (_uneven(fit.quarter_saturation) > MOST_UNEVEN_SATURATION)),
        ("occluded", darker < -MOST_QUARTER_MISFIT),
        ("disturbed by something beside it", fit.misfit > _most_misfit(fit)),
        ("too little contrast", ~(deviation < MOST_DEVIATION_PX)),
    ]
    plausible = ~np.any([wrong for _, wrong in verdicts], axis=0)
    verdicts.append(("not where its neighbours on the board place it", _displaced(fit, detection, columns, plausible)))
    wrongs = np.array([wrong for _, wrong in verdicts])
    rejected: list[RejectedCorner | None] = [None] * len(detection)
    for index in np.flatnonzero(wrongs.any(axis=0)):
        reason, _ = verdicts[int(wrongs[:, index].argmax())]
        x, y = detection.pixels[index].tolist()
        rejected[index] = RejectedCorner(int(detection.ids[index]), (x, y), reason)
    return rejected


def summary(rejected: tuple[RejectedCorner, ...], of: int) -> str:
    """One line that says how many were rejected, and why."""
    if not rejected:
        return ""
    counts = Counter(corner.reason for corner in rejected).most_common()
    return f"{len(rejected)} of {of} corners rejected: " + ", ".join(f"{reason} ({n})" for reason, n in counts)


def _most_misfit(fit: CornerFit) -> float:
    """What all corners have is not beside one of them."""
    usual = float(np.median(fit.misfit[fit.converged])) if fit.converged.any() else 0.0
    return float(np.clip(USUAL_MISFIT * usual, MOST_MISFIT, MOST_USUAL_MISFIT))


def _displaced(fit: CornerFit, detection: Detection, columns: int, plausible: Mask) -> Mask:
    """(n,) whether an otherwise plausible corner is where, by its plausible neighbours, none can be."""
    off = np.zeros(len(detection), dtype=bool)
    if plausible.any():
        off[plausible] = displaced(fit.pixels[plausible], detection.ids[plausible], columns)
    return off


def _uneven(share: Floats) -> Floats:
    """(n,) largest difference between opposite quarters of a window."""
    return np.maximum(np.abs(share[:, 0] - share[:, 3]), np.abs(share[:, 1] - share[:, 2]))
