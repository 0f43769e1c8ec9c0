"""The compiled fit of a corner, against the same model and the same sums written down in NumPy and double precision."""

from ctypes import c_int64

import numpy as np
import pytest
from scipy.ndimage import map_coordinates
from scipy.special import erf

from opencsp_calib.arrays import Floats
from opencsp_calib.corner_kernel import PARAMETERS, RAMP_PX, fit_corners
from opencsp_calib.native import array_of, native_function, result_of

MODEL = np.array([0.2, -0.1, 0.15, 1.3, 1.3, 100.0, 60.0, 0.03, -0.02, 1.0, -0.8])  # light far steeper than any
BENDS = np.array([0.002, -0.001])
FAR = np.array([100.0, 100.0, np.inf, np.inf])
WHITE = 200.0


def columns(p: Floats, x: Floats, y: Floats, bends: Floats = BENDS, window: Floats = FAR) -> Floats:
    """The derivatives by each parameter and the residual of black pixels at (x, y) from the corner on."""
    line = array_of(np.float64, 1)
    corner_image = native_function("corner_image", line, line, line, c_int64, line, line, result_of(np.float64, 2))
    made = np.empty((PARAMETERS + 1, len(x)))
    corner_image(p, bends, window, len(x), x, y, made)
    return made


def image(p: Floats, x: Floats, y: Floats, bends: Floats = BENDS) -> Floats:
    """The model's grey levels at (x, y) from the corner on."""
    edges, profiles, slopes, zs = [], [], [], []
    for angle, bend in zip(p[2:4], bends, strict=True):
        cosine, sine = np.cos(angle), np.sin(angle)
        z = (y * cosine - x * sine - bend / 2 * (x * cosine + y * sine) ** 2) / p[4]
        box = -(cosine**4 + sine**4) / 120 / 12 / p[4] ** 4  # fourth cumulant of a pixel across the edge, over 4!/2
        bell = np.exp(-(z**2) / 2) / np.sqrt(2 * np.pi)
        zs.append(z)
        profiles.append(erf(z / np.sqrt(2)) - box * (z**3 - 3 * z) * bell)
        slopes.append((2 + box * (z**4 - 6 * z**2 + 3)) * bell)
        edges.append((cosine, sine))
    lean = np.dot(*edges)
    pattern = profiles[0] * profiles[1] + lean * slopes[0] * slopes[1] * (1 + lean / 2 * zs[0] * zs[1])
    return p[5] + p[7] * x + p[8] * y + (p[6] + p[9] * x + p[10] * y) * pattern


@pytest.mark.parametrize("second_edge", [0.15 + np.pi / 2, 1.3, -2.2])
def test_the_model_and_its_derivatives(second_edge: float) -> None:
    x, y = np.random.default_rng(1).uniform(-6, 6, (2, 200))
    p = np.array([*MODEL[:3], second_edge, *MODEL[4:]])
    found = columns(p, x, y)
    assert -found[-1] == pytest.approx(image(p, x, y), abs=2e-3)
    for k in range(PARAMETERS):
        step = np.zeros(PARAMETERS)
        step[k] = 1e-5
        moved = [image(p + way * step, x - way * step[0], y - way * step[1]) for way in (1, -1)]
        numeric = (moved[0] - moved[1]) / 2e-5
        # the smallest terms of the model are left out of its derivatives
        assert np.abs(numeric - found[k]).max() < (0.04 if k < 5 else 1e-4) * np.abs(found[k]).max()


@pytest.fixture(scope="module")
def photograph() -> Floats:
    """A corner at (40.2, 39.9), noise that is alike in no way, a bright spot in one quarter."""
    grey = clean() + np.random.default_rng(2).normal(0, 3, (80, 80))
    grey[46:49, 44:50] = 230
    return np.clip(np.rint(grey), 0, 255).astype(np.uint8)


def clean() -> Floats:
    y, x = np.mgrid[:80, :80] - 40.0
    return image(MODEL, x - MODEL[0], y - MODEL[1])


HALF = np.array([[9.3, 8.1, np.inf, np.inf]])


def fitted(photograph: Floats, bends: Floats = BENDS, half: Floats = HALF) -> tuple[Floats, Floats]:
    p = (MODEL + 40 * np.eye(2, PARAMETERS).sum(axis=0))[None]
    found = fit_corners(photograph, WHITE, p, bends[None], half, 5e-6, 60, examine=True)
    assert found[0, 0] == 0
    return p[0], found[0]


@pytest.fixture(scope="module")
def window(photograph: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Of the pixels within the window: row, column, derivatives, residual times the root of the weight."""
    p, _ = fitted(photograph)
    row, column = np.mgrid[:80, :80].reshape(2, -1)
    x, y = column - p[0], row - p[1]
    across = [y * np.cos(angle) - x * np.sin(angle) for angle in p[2:4]]
    along = np.abs(across[::-1] / np.sin(p[3] - p[2]))
    inside = (along < HALF[0, :2, None] + RAMP_PX / 2).all(axis=0)
    row, column, x, y = row[inside], column[inside], x[inside], y[inside]
    made = columns(p, x, y, window=HALF[0])
    return row, column, made[:-1], made[-1] + made[5] * photograph[row, column]


def test_how_sure_a_place_is(photograph: Floats, window: tuple[Floats, ...]) -> None:
    p, found = fitted(photograph)
    _, _, derivatives, residual = window
    normal = derivatives @ derivatives.T
    variance = residual @ residual / (derivatives[5] ** 2).sum()
    usual = np.array([0.02, 0.02, 0.002, 0.002]) * p[6]  # gradients, known before looking
    normal[range(7, 11), range(7, 11)] += variance / usual**2
    inverse = np.linalg.inv(normal)
    assert found[3:6] == pytest.approx([inverse[0, 0], inverse[0, 1], inverse[1, 1]], rel=1e-4)
    # and nothing is left to be done
    gradient = derivatives @ residual
    gradient[7:] -= variance / usual**2 * p[7:]
    assert np.abs(inverse @ gradient)[:4].max() < 1e-4


def test_how_a_place_follows_the_bend_of_its_edges() -> None:
    photograph = np.rint(200 * clean()).astype(np.uint16)
    _, found = fitted(photograph)
    for edge in range(2):
        step = np.eye(2)[edge] * 1e-3
        (before, _), (after, _) = (fitted(photograph, BENDS + way * step) for way in (-1, 1))
        assert found[[6 + edge, 8 + edge]] == pytest.approx((after - before)[:2] / 2e-3, abs=0.5)  # of 15


def test_what_disturbs_it(photograph: Floats, window: tuple[Floats, ...]) -> None:
    p, found = fitted(photograph)
    row, column, derivatives, residual = window
    root = derivatives[5]
    x, y = column - p[0], row - p[1]
    sides = [y * np.cos(angle) > x * np.sin(angle) for angle in p[2:4]]
    quarters = [(sides[0] == one) & (sides[1] == other) for one in (False, True) for other in (False, True)]
    weights = np.array([(root[quarter] ** 2).sum() for quarter in quarters])
    saturated = root**2 * (photograph[row, column] >= WHITE)
    assert found[18:22] == pytest.approx(weights, rel=1e-4)
    assert found[14:18] == pytest.approx([saturated[q].sum() for q in quarters] / weights, rel=1e-4)
    misfit = np.array([(root * residual)[quarter].sum() for quarter in quarters]) / weights / abs(p[6])
    assert found[10:14] == pytest.approx(misfit, abs=1e-4)
    assert found[22] == pytest.approx(residual @ residual / (weights.sum() - PARAMETERS), rel=1e-3)
    picture = np.full((80, 80), np.nan)
    picture[row[root > 0.999], column[root > 0.999]] = residual[root > 0.999]
    opposite = map_coordinates(picture, [2 * p[1] - row, 2 * p[0] - column], order=1)
    unlike = (picture[row, column] - opposite)[np.isfinite(picture[row, column] - opposite)]
    right, down = 2 * p[0] % 1, 2 * p[1] % 1
    gain = 1 + (right**2 + (1 - right) ** 2) * (down**2 + (1 - down) ** 2)
    assert found[1] == pytest.approx((unlike**2).sum() / gain / (len(unlike) - 8), rel=1e-3)
    assert found[2] == pytest.approx(np.nanmean(np.diff(picture, axis=1) ** 2) / 2, rel=1e-3)
